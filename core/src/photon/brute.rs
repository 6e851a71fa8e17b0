//! Brute-force reference of the searches, for tests: it visits every photon of a map.

use super::{
    DensityEstimate, FLATNESS, Kernel, MIN_NORMAL_COSINE, PhotonMap, QueryDisc, Response, layout::LEAF,
};
use core::f32::consts::PI;
use glam::Vec3;
use halflight_simd::kernels::points::squared_distance;

/// Index and squared distance, in units of the map, of every photon within `radius` of `place`.
pub fn within(map: &PhotonMap, place: Vec3, radius: f32) -> impl Iterator<Item = (u32, f32)> {
    let place = map.space.to_map(place.to_array());
    let squared_radius = map.space.squared_to_map(radius).unwrap_or(-1.0);
    let map = *map;
    let all = (0..map.count).map(move |i| {
        let photon = map.leaves.get(i / LEAF).map(|leaf| leaf.photon(i % LEAF).position);
        (i as u32, squared_distance(place, photon.unwrap_or([f32::NAN; 3])))
    });
    all.filter(move |&(_, distance)| distance <= squared_radius)
}

/// Reference of [`PhotonMap::gather`]: the same photons, summed in another order.
pub fn gather<R: Response>(map: &PhotonMap, disc: &QueryDisc, response: &R) -> DensityEstimate {
    let mut density = DensityEstimate::default();
    let squared_radius = map.space.squared_to_map(disc.radius).unwrap_or(0.0);
    if !(squared_radius > 0.0 && squared_radius < f32::MAX) {
        return density;
    }
    let place = Vec3::from_array(map.space.to_map(disc.place.to_array()));
    let thickness = FLATNESS * libm::sqrtf(squared_radius);
    for (index, distance) in within(map, disc.place, disc.radius) {
        let leaf = map.leaves.get(index as usize / LEAF);
        let Some(photon) = leaf.map(|leaf| leaf.photon(index as usize % LEAF)) else { continue };
        let along = photon.normal_in_steps().dot(disc.normal);
        let flat = (place - photon.position()).dot(disc.normal).abs() <= thickness;
        let alike = photon.normal_in_steps().length_squared() * (MIN_NORMAL_COSINE * MIN_NORMAL_COSINE)
            <= along * along;
        let is_short = photon.remaining() >= map.least_remaining;
        if is_short && flat && alike && along > 0.0 && photon.direction_in_steps().dot(disc.normal) > 0.0 {
            let arrives = photon.power() * response.of(photon.direction());
            let weight = |squared_radius: f32| {
                let squared = (distance * (1.0 / squared_radius).min(f32::MAX)).min(1.0);
                match disc.kernel {
                    Kernel::Constant => 1.0,
                    Kernel::Cone => 3.0 * (1.0 - libm::sqrtf(squared)),
                    Kernel::Epanechnikov => 2.0 * (1.0 - squared),
                }
            };
            density.radiance += arrives * weight(squared_radius);
            let mut squared_radius = squared_radius;
            for finer in &mut density.finer {
                squared_radius /= 4.0;
                if distance <= squared_radius {
                    *finer += arrives * weight(squared_radius);
                }
            }
            density.photons += 1;
        }
    }
    let per_area = |radius: f32| 1.0 / (PI * radius) / radius;
    density.radiance *= per_area(disc.radius);
    let mut radius = disc.radius;
    for finer in &mut density.finer {
        radius *= 0.5;
        *finer *= per_area(radius);
    }
    density
}
