//! The reference: every photon of a map is looked at. For tests, and for those who doubt.

use super::{ALIKE, Density, Disc, FLATNESS, Falloff, PhotonMap, Response, layout::LEAF};
use crate::Rgb;
use core::f32::consts::PI;
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

/// What [`PhotonMap::gather`] estimates, photon by photon in unit vectors: to rounding the same, but for photons
/// that a rounding puts in or out of the disc.
pub fn gather<R: Response>(map: &PhotonMap, disc: &Disc, response: &R) -> Density {
    let mut density = Density::default();
    if !(disc.radius > 0.0 && disc.radius < f32::INFINITY) {
        return density;
    }
    for (index, _) in within(map, disc.place, disc.radius) {
        let Some(photon) = map.get(index) else { continue };
        let offset = disc.place - photon.position();
        let flat = offset.dot(disc.normal).abs() <= FLATNESS * disc.radius;
        let alike = photon.normal().dot(disc.normal) >= ALIKE;
        if flat && alike && photon.direction().dot(disc.normal) > 0.0 {
            let ratio = (offset.length() / disc.radius).min(1.0);
            let weight = match disc.falloff {
                Falloff::Constant => 1.0,
                Falloff::Cone => 3.0 * (1.0 - ratio),
                Falloff::Epanechnikov => 2.0 * (1.0 - ratio * ratio),
            };
            density.radiance += photon.power() * response.of(photon.direction()) * weight;
            density.photons += 1;
        }
    }
    density.radiance = density.radiance / (PI * disc.radius) / disc.radius;
    if density.photons == 0 { Density { radiance: Rgb::ZERO, ..density } } else { density }
}
