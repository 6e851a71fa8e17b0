//! The reference: every photon of a map is looked at. For tests, and for those who doubt.

use super::{PhotonMap, layout::LEAF};
use glam::Vec3;
use halflight_simd::kernels::points::squared_distance;

/// Index and squared distance, in units of the map, of every photon within `radius` of `place`.
pub fn within(map: &PhotonMap, place: Vec3, radius: f32) -> impl Iterator<Item = (u32, f32)> {
    let place = map.space.enter(place.to_array());
    let squared_radius = map.space.squared(radius).unwrap_or(-1.0);
    let map = *map;
    let all = (0..map.count).map(move |i| {
        let photon = map.leaves.get(i / LEAF).map(|leaf| leaf.photon(i % LEAF).position);
        (i as u32, squared_distance(place, photon.unwrap_or([f32::NAN; 3])))
    });
    all.filter(move |&(_, distance)| distance <= squared_radius)
}
