//! Resolution of an irradiance cache by the work of its picture: more gather rays for each record, and more
//! records, where their gathering is a part of the work.

use super::work_of_detail;
use crate::cache::irradiance::metric::HESSIAN_ERROR;

/// Work of a gather ray, in rays of paths.
const GATHER_RAY: f64 = 1.5;

/// Gather rays for each pixel of a picture of one pixel at [`CacheResolution::COARSEST`]; they fall with this
/// power of the pixels. Measured on 17 scenes at 576 and 4096 pixels, within a factor of two.
const GATHER_RAYS: f64 = 5700.0;
const GATHER_POWER: f64 = 0.4;

/// Greatest fraction of the work for a finer cache.
const FILLING: f64 = 0.4;

/// Gather rays of a record, and the density of records.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheResolution {
    /// Strata along a side of the hemisphere.
    pub strata: u32,
    /// Allowed error of [`crate::cache::irradiance::Metric::Halflight`].
    pub error: f32,
}

impl CacheResolution {
    /// Resolution of short renders.
    pub const COARSEST: Self = Self { strata: 16, error: HESSIAN_ERROR };

    /// Resolutions from the finest on.
    const FINER: [Self; 3] = [
        Self { strata: 32, error: 1e-5 },
        Self { strata: 32, error: 3e-5 },
        Self { strata: 16, error: 3e-5 },
    ];

    /// Resolution of a picture of `pixels` pixels in `shards` parts, with time for `rays` for each pixel.
    /// `triangles` is the number of those of the scene.
    pub fn of_budget(rays: f64, (pixels, triangles): (f64, usize), shards: u32) -> Self {
        let affordable = |finer: &&Self| shards as f64 * finer.filling(pixels, triangles) <= FILLING * rays;
        Self::FINER.iter().find(affordable).copied().unwrap_or(Self::COARSEST)
    }

    /// Work of filling for each of `pixels` pixels, in rays of paths, in a scene with this number of
    /// `triangles`.
    pub fn filling(&self, pixels: f64, triangles: usize) -> f64 {
        let relative = |of: fn(&Self) -> f64| of(self) / of(&Self::COARSEST);
        let rays = relative(|resolution| f64::from(resolution.strata * resolution.strata));
        // Errors grow with the fourth power of radii.
        let records = 1.0 / libm::sqrt(relative(|resolution| resolution.error.into()));
        let coarsest = GATHER_RAY * GATHER_RAYS * libm::pow(pixels, -GATHER_POWER);
        coarsest * rays * records * work_of_detail(triangles)
    }
}

impl Default for CacheResolution {
    fn default() -> Self {
        Self::COARSEST
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longer_renders_have_finer_caches_within_a_part_of_the_work() {
        let pixels = 16384.0;
        let of = |rays, shards| CacheResolution::of_budget(rays, (pixels, 36), shards);
        let mut last = CacheResolution::COARSEST.filling(pixels, 36);
        for rays in [10.0, 100.0, 1e3, 3e3, 1e4, 1e5] {
            let chosen = of(rays, 1);
            let filling = chosen.filling(pixels, 36);
            assert!(filling >= last && (chosen == CacheResolution::COARSEST || filling <= FILLING * rays));
            last = filling;
        }
        assert_eq!(of(1e5, 1), CacheResolution::FINER[0]);
        assert_eq!(of(1e3, 8), CacheResolution::COARSEST);
        let detailed = CacheResolution::of_budget(1e4, (pixels, 1 << 20), 1);
        assert!(of(1e4, 1).strata > detailed.strata, "more detail takes more records");
    }
}
