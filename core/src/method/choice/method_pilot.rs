//! Pilot of a method by the method itself: the first samples of a few tiles of the picture. The halves of the
//! samples show noise and blur, counters the work.

use super::trial::variances;
use crate::estimate::{BiasEstimate, TileBlur};
use crate::film::{PIXELS_PER_TILE, Pixel, Tile};
use crate::memory::{MemorySource, OutOfMemory};
use crate::method::executor::Executor;
use crate::method::tuned::{LIGHT_RAY, PHOTON};
use crate::method::{RenderContext, RenderMethod, RenderState, Round, Shard};
use crate::transport::{PathSettings, RadiusSchedule};

/// Samples of a pixel, one of each half.
pub(super) const SAMPLES: u32 = 2;

/// Samples of a half up to which radii shrink in a prediction.
const MOST_SHRINKING: f64 = 1e5;

/// Noise, blur and work of the first samples of a method.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MethodPilot {
    /// Variance of a sample relative to the light of its pixel or block.
    pub noise: f64,
    /// Squared blur of density estimates relative to the light of the pixel.
    pub blur: f64,
    /// Rays of a sample of a pixel, with its share of the light paths.
    pub work: f64,
}

impl MethodPilot {
    /// Pilot of a `method` for the picture of `context`; it is built in `memory`. `None` where the executor
    /// is over.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` is too small for a film and the method, or the scratch of the executor
    /// for its tasks.
    pub fn run<'m, S: MemorySource<'m>, E: Executor, M: RenderMethod>(
        context: &RenderContext<'m>,
        memory: &mut S,
        executor: &mut E,
        method: impl FnOnce(&RenderContext<'m>, &mut S, &mut E) -> Result<M, OutOfMemory>,
    ) -> Result<Option<Self>, OutOfMemory> {
        // Samples that the picture does not have.
        let settings = PathSettings { seed: !context.settings.seed, ..context.settings };
        let context = RenderContext { settings, ..*context };
        let PathSettings { width, height, .. } = settings;
        memory.lend("pilot", RenderState::footprint(width, height), |memory, arena| {
            let mut state = RenderState::new(width, height, Shard::WHOLE, arena)?;
            state.samples.fill(SAMPLES);
            for tile in Tile::spread_over(width, height, context.pilots.tiles()) {
                state.samples[tile] = 0;
            }
            let mut method = method(&context, memory, executor)?;
            method.round(&mut Round { executor, state: &mut state, target: SAMPLES, step: 1 })?;
            Ok((state.spp() == SAMPLES).then(|| Self::of(&state, context.pixels())))
        })
    }

    /// By the tiles of `state` that have samples, in a picture of so many `pixels`.
    fn of(state: &RenderState, pixels: usize) -> Self {
        let tiles = || state.film.pixels().chunks(PIXELS_PER_TILE).filter(|tile| tile[0].count() > 0);
        let sum = |of: &dyn Fn(&[Pixel]) -> f64| tiles().map(of).sum::<f64>();
        let of_pixel = |pixel: &Pixel| f64::from(pixel.mean().element_sum()) / 3.0;
        let samples = f64::from(SAMPLES);
        let count = sum(&|tile| tile.iter().filter(|pixel| pixel.count() > 0).count() as f64).max(1.0);
        let mean = sum(&|tile| tile.iter().map(of_pixel).sum()) / count;
        let blur = BiasEstimate::of_blur(tiles().map(|tile| TileBlur::of(tile, mean)));
        let rays_of_passes = (state.counters.all_rays() - state.rays_of_tiles) as f64;
        let of_passes = f64::from(LIGHT_RAY + PHOTON) * rays_of_passes / pixels as f64;
        Self {
            noise: samples * sum(&|tile| variances([tile], mean).0[0]) / count,
            blur: blur.map_or(0.0, |blur| blur.relmse.max(0.0)),
            work: (state.rays_of_tiles as f64 / count + of_passes) / samples,
        }
    }

    /// With so much less noise, and the same blur.
    pub fn reduced(self, gain: f64) -> Self {
        Self { noise: self.noise / gain, ..self }
    }

    /// relMSE of a picture after so much work for each pixel. The squared radii r² of density estimates
    /// shrink as n^(-1/3): the variance of a sample is as 1 / r², its blur as r².
    pub fn error(&self, work: f64) -> f64 {
        let samples = work / self.work;
        let last = RadiusSchedule::shrinkage((0.5 * samples).min(MOST_SHRINKING) as u32);
        // Means over all samples.
        let [density, area] = [(0.75 / last).max(1.0), (1.5 * last).min(1.0)];
        self.noise * density / samples + self.blur * area * area
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean over samples of the closed forms, which hold for many.
    const NEAR: f64 = 0.06;

    #[test]
    fn errors_are_sums_over_shrinking_radii() {
        let pilot = MethodPilot { noise: 3.0, blur: 0.01, work: 5.0 };
        for samples in [8, 64, 1024] {
            let count = f64::from(samples);
            let shrinkage = || (0..samples).map(|sample| RadiusSchedule::shrinkage(sample / 2));
            let density = shrinkage().map(|squared| 1.0 / squared).sum::<f64>() / count;
            let area = shrinkage().sum::<f64>() / count;
            let expected = 3.0 * density / count + 0.01 * area * area;
            let error = pilot.error(5.0 * count);
            assert!((error / expected - 1.0).abs() < NEAR, "{samples}: {error} {expected}");
        }
        assert!((pilot.error(5.0) - 3.01).abs() < 1e-9);
    }
}
