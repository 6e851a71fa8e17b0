//! Gather rays: one in each stratum of the hemisphere around z, in the layout of the core.

use glam::{DVec3, Vec3};

/// Surface that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Radiance towards the origin of the ray.
    pub radiance: f64,
    /// Inverse distance; 0 at infinity.
    pub inverse: f64,
    /// Unit normal, towards the origin of the ray.
    pub normal: DVec3,
}

/// Rays and their hits, stratum by stratum.
pub struct GatherRays {
    /// Strata along a side.
    pub strata: usize,
    /// Radiance, the same in all channels.
    pub radiance: Vec<[f32; 3]>,
    /// Inverse distances.
    pub inverse: Vec<f32>,
    /// Unit directions.
    pub directions: Vec<[f32; 3]>,
    /// Normals of hits.
    pub normals: Vec<[f32; 3]>,
}

impl GatherRays {
    /// Rays by `warp` of the unit square to directions, at `offset` (0 to 1) in each stratum along both
    /// sides; `hit` has the surface that a direction meets.
    pub fn new(
        strata: usize,
        warp: impl Fn([f32; 2]) -> Vec3,
        mut offset: impl FnMut() -> f64,
        hit: impl Fn(Vec3) -> Hit,
    ) -> Self {
        let (mut radiance, mut inverse, mut directions, mut normals) = (vec![], vec![], vec![], vec![]);
        for stratum in 0..strata * strata {
            let place = [stratum % strata, stratum / strata];
            let w = warp(place.map(|k| ((k as f64 + offset()) / strata as f64) as f32));
            let hit = hit(w);
            radiance.push([hit.radiance as f32; 3]);
            inverse.push(hit.inverse as f32);
            directions.push(w.to_array());
            normals.push(hit.normal.as_vec3().to_array());
        }
        Self { strata, radiance, inverse, directions, normals }
    }
}
