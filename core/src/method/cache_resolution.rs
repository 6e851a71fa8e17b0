//! Resolution of a cache: the gather rays of its records, and their density. Finer caches have less noise and
//! take more time to fill.
//!
//! The first cache of a picture is filled at the coarsest resolution, and its rays are counted. Those of
//! finer ones follow from them. A finer resolution is used where the picture is predicted to gain by it: the
//! cache is then filled again.

use super::tuned::{
    CACHE_BIAS, FILLING, FILLING_POWER, FILLING_RAYS, FINER_FILLING, GATHER_RAY, GATHER_RAY_OF_FEW,
    RECORDS_OF_PIXEL,
};
use super::work_of_detail;
use crate::cache::irradiance::metric::HESSIAN_ERROR;

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

    /// Resolutions that a cache may have, by the rays of filling.
    const ALL: [Self; 5] = [
        Self::COARSEST,
        Self { strata: 16, error: 3e-5 },
        Self { strata: 32, error: HESSIAN_ERROR },
        Self { strata: 32, error: 3e-5 },
        Self::FINEST,
    ];

    /// Resolution of long renders.
    pub const FINEST: Self = Self { strata: 32, error: 1e-5 };

    /// Rays of filling relative to [`CacheResolution::COARSEST`].
    pub fn filling(&self) -> f64 {
        let relative = |of: fn(&Self) -> f64| of(self) / of(&Self::COARSEST);
        let rays = relative(|resolution| f64::from(resolution.strata * resolution.strata));
        // Errors grow with the fourth power of radii.
        rays / libm::sqrt(relative(|resolution| resolution.error.into()))
    }

    /// Predicted work of filling both caches of a picture of `pixels` pixels at this resolution, in rays of
    /// paths, in a scene with this number of `triangles`.
    pub fn predicted_filling(&self, pixels: f64, triangles: usize) -> f64 {
        let coarsest = FILLING_RAYS * libm::pow(pixels, 1.0 - FILLING_POWER);
        coarsest * self.filling() * work_of_detail(triangles)
    }
}

impl Default for CacheResolution {
    fn default() -> Self {
        Self::COARSEST
    }
}

/// Work and noise of a picture with a cache.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CachedPicture {
    /// Rays of paths for which there is time.
    pub rays: f64,
    /// relMSE × rays of light that no record supplies.
    pub samples: f64,
    /// Variance of the light of one gather ray, relative to the light of the picture.
    pub gathered: f64,
}

impl CachedPicture {
    /// Picture of so many `rays` of which only the time is known. Its cache is the finest for which there is
    /// time.
    pub fn of_time(rays: f64) -> Self {
        Self { rays, samples: 0.0, gathered: 1.0 }
    }

    /// relMSE by records of `resolution`, however many samples there are.
    fn floor(&self, resolution: &CacheResolution) -> f64 {
        let record_rays = f64::from(resolution.strata * resolution.strata);
        let bias = CACHE_BIAS * f64::from(resolution.error / CacheResolution::COARSEST.error);
        self.gathered / (record_rays * RECORDS_OF_PIXEL) + bias
    }

    /// Predicted relMSE after all rays, of which `filling` fill the cache at `resolution`.
    pub fn error_after(&self, resolution: &CacheResolution, filling: f64) -> f64 {
        let most = FILLING * self.rays;
        let wider = (filling / most).max(1.0);
        self.samples / (self.rays - filling.min(most)) + wider * self.floor(resolution)
    }

    /// The resolution with the least error after the time, of those that leave enough of it. `filling` is the
    /// work of filling both caches at [`CacheResolution::COARSEST`], in rays of paths.
    pub fn resolution(&self, filling: f64) -> CacheResolution {
        let with = |resolution: &CacheResolution| filling * resolution.filling();
        let is_affordable = |resolution: &&CacheResolution| with(resolution) <= FINER_FILLING * self.rays;
        let error = |resolution: &CacheResolution| self.error_after(resolution, with(resolution));
        let affordable = CacheResolution::ALL.iter().filter(is_affordable);
        affordable.min_by(|a, b| error(a).total_cmp(&error(b))).copied().unwrap_or_default()
    }

    /// Work of counted `rays` of filling, in rays of paths, in a scene with this number of `triangles`.
    pub fn filling_of(rays: u64, triangles: usize) -> f64 {
        (GATHER_RAY + GATHER_RAY_OF_FEW / work_of_detail(triangles)) * rays as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COARSEST: f64 = 2e6;

    #[test]
    fn longer_renders_have_finer_caches_within_a_part_of_the_work() {
        let mut last = 0.0;
        for rays in [1e5, 1e6, 1e7, 3e7, 1e8, 1e9] {
            let chosen = CachedPicture::of_time(rays).resolution(COARSEST);
            let filling = COARSEST * chosen.filling();
            assert!(filling >= last && (chosen == CacheResolution::COARSEST || filling <= 0.4 * rays));
            last = filling;
        }
        let of = |rays, filling| CachedPicture::of_time(rays).resolution(filling);
        assert_eq!(of(1e9, COARSEST), CacheResolution::FINEST);
        assert_eq!(of(1e9, 400.0 * COARSEST), CacheResolution::COARSEST);
    }

    #[test]
    fn light_of_much_variance_has_more_rays_and_noise_of_samples_leaves_them_out() {
        let of = |gathered, samples| CachedPicture { rays: 8e7, samples, gathered }.resolution(COARSEST);
        assert_eq!(of(50.0, 1e4).strata, 32);
        assert_eq!(of(0.1, 1e6), CacheResolution::COARSEST);
        assert!(of(0.1, 1e3).error < CacheResolution::COARSEST.error);
    }
}
