//! The pilot of Metropolis light transport: a rough picture, lengths of paths, and the size of a sample.

use super::Metropolis;
use super::plan::Plan;
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Pixel};
use crate::light::luminance;
use crate::memory::OutOfMemory;
use crate::method::executor::Executor;
use crate::transport::metropolis::bootstrap::{Bootstrap, Lengths};
use crate::transport::metropolis::split::{CELL, MAX_SEGMENTS, Split};
use core::ops::Range;

/// Number of the first pass of the pilot.
const PILOT: u32 = 1 << 30;

/// Points of the pilot, its passes, and pixels of its paths, at most.
const PILOT_POINTS: usize = 1 << 17;
const MOST_PASSES: usize = 32;
const PILOT_PIXELS: usize = 1 << 18;

/// Points of a pilot where there is no time for more: it may end after the picture's time.
const SHORT_PILOT_POINTS: usize = PILOT_POINTS / 16;

/// Fractions of the picture's time after which the pilot ends, and the points that measure the cost of a
/// sample.
const PILOT_TIME: f32 = 0.4;
const MEASURED_TIME: f32 = 0.6;

/// Cells of a tile.
const CELLS: usize = PIXELS_PER_TILE / CELL;

/// Least level of a pixel, relative to the mean of the picture.
const LEAST_LEVEL: f32 = 0.1;

impl<'a, F: Features> Metropolis<'a, F> {
    /// Finds a rough picture, how much light paths of each length bring to chains, and how many chains there
    /// is time for in a sample. Where there is no time for that, path tracing has all light that it can find.
    pub(super) fn pilot(
        &mut self,
        levels: &'a mut [f32],
        threshold: f32,
        executor: &mut impl Executor,
    ) -> Result<(), OutOfMemory> {
        if !self.is_needed() {
            return Ok(());
        }
        let whole = self.plan;
        self.plan = whole.at_most(PILOT_POINTS);
        let mut passes = self.passes(PILOT_POINTS);
        let is_complete = executor.within(PILOT_TIME, |executor| self.learn(levels, passes, executor))?;
        let mut is_known = is_complete;
        if !is_complete {
            self.plan = whole.at_most(SHORT_PILOT_POINTS);
            passes = self.passes(SHORT_PILOT_POINTS);
            is_known = self.learn(levels, passes, executor)?;
        }
        if is_known {
            self.split = Split { levels, threshold, ..self.split };
            is_known = self.measure_lengths(PILOT + 2 * passes..PILOT + 3 * passes, executor)?;
        }
        if !is_known {
            self.plan.chains = 0;
            self.split.threshold = f32::INFINITY;
        } else if is_complete {
            self.plan = match self.plan == whole {
                true => whole,
                false => executor.within(MEASURED_TIME, |executor| self.affordable(whole, executor))?,
            };
        }
        self.totals = super::Totals::default();
        Ok(())
    }

    /// Passes of a pilot of `points`.
    fn passes(&self, points: usize) -> u32 {
        (points / self.plan.points()).clamp(1, MOST_PASSES) as u32
    }

    /// The rough picture by `passes` of chains of all lengths. Whether the executor was not over.
    fn learn(
        &mut self,
        levels: &mut [f32],
        passes: u32,
        executor: &mut impl Executor,
    ) -> Result<bool, OutOfMemory> {
        self.lengths = Lengths::new(self.target().lengths(), |_| 1.0);
        if !self.measure_lengths(PILOT..PILOT + passes, executor)? {
            return Ok(false);
        }
        levels.fill(0.0);
        for sample in PILOT + passes..PILOT + 2 * passes {
            if self.chain_pass(sample, executor)?.is_none() {
                return Ok(false);
            }
            let cells = levels.iter_mut().zip(self.picture.chunks(CELL));
            cells.for_each(|(level, cell)| *level += cell.iter().map(|&c| luminance(c.into())).sum::<f32>());
        }
        self.measure_levels(levels, passes as f32, executor)
    }

    /// The part of a `whole` sample that takes about as long as the executor had for this.
    fn affordable(&mut self, whole: Plan, executor: &mut impl Executor) -> Result<Plan, OutOfMemory> {
        self.plan = whole;
        self.densities.fill(f32::NAN);
        if self.bootstrap(PILOT - 1, executor)?.is_some() {
            return Ok(whole);
        }
        let evaluated = self.densities.iter().filter(|density| !density.is_nan()).count();
        Ok(whole.at_most(evaluated / 2))
    }

    /// Makes of `levels`, the light of `passes` passes of chains in each cell, its mean radiance with the
    /// light that is not for chains. In large pictures a run of tiles has one level, by the paths of its
    /// first tile. Whether the executor was not over.
    fn measure_levels(
        &self,
        levels: &mut [f32],
        passes: f32,
        executor: &mut impl Executor,
    ) -> Result<bool, OutOfMemory> {
        let paths = self.paths();
        let tiles = self.context.pixels().div_ceil(PILOT_PIXELS).max(1);
        let runs = levels.chunks_mut(tiles * CELLS);
        let rough = executor.pass(runs, |run, levels, worker| {
            let mut arena = worker.scratch.scratch();
            let pixels: &mut [Pixel] = arena.slice(PIXELS_PER_TILE)?;
            pixels.fill(Pixel::default());
            let counters = paths.run(run * tiles, PILOT..PILOT + 1, &[], &mut arena, pixels)?;
            if tiles > 1 {
                let mean = levels.iter().sum::<f32>() / levels.len() as f32;
                levels.fill(mean);
            }
            for (level, pixels) in levels.iter_mut().zip(pixels.chunks(CELL)) {
                let seen = pixels.iter().filter(|pixel| pixel.count() > 0);
                let sum: f32 = seen.clone().map(|pixel| luminance(pixel.mean())).sum();
                *level = (*level / passes + sum) / seen.count().max(1) as f32;
            }
            if tiles > 1 {
                let first = levels.len().min(CELLS);
                let mean = levels[..first].iter().sum::<f32>() / first as f32;
                levels.fill(mean);
            }
            Ok(counters)
        })?;
        let mean = levels.iter().sum::<f32>() / levels.len() as f32;
        let least = if mean > 0.0 { LEAST_LEVEL * mean } else { 1.0 };
        levels.iter_mut().for_each(|level| *level = level.max(least));
        Ok(rough.is_complete)
    }

    /// Sets the probabilities of lengths by the independent points of `samples`. Whether the executor was not
    /// over.
    fn measure_lengths(
        &mut self,
        samples: Range<u32>,
        executor: &mut impl Executor,
    ) -> Result<bool, OutOfMemory> {
        let mut sums = [0.0; MAX_SEGMENTS as usize + 1];
        for sample in samples {
            if self.bootstrap(sample, executor)?.is_none() {
                return Ok(false);
            }
            let bootstrap = Bootstrap::new(self.target(), self.lengths, self.context.settings.seed, sample);
            for (&density, candidate) in self.densities[..self.plan.candidates].iter().zip(0..) {
                if let Some(sum) = sums.get_mut(bootstrap.length(candidate).0 as usize) {
                    *sum += f64::from(density);
                }
            }
        }
        self.lengths = Lengths::new(self.target().lengths(), |segments| sums[segments as usize]);
        Ok(true)
    }
}
