//! Metropolis light transport (Veach and Guibas 1997) in primary sample space: multiplexed (Hachisuka et al.
//! 2014) or over path tracing (Kelemen et al. 2002), and selective (Bitterli and Jarosz 2019).
//!
//! For each sample of the picture independent points are drawn, chains start from them, and their splats make
//! the sample together with a path that is traced for each pixel. The mean density of the points is the
//! brightness of the chains' light. Points, starts and chains are new for each sample: it has no bias however
//! short the chains are, the halves of the film stay independent, and no brightness is estimated once and for
//! all.

use super::executor::{Executor, Passed};
use super::splats::{add_splats, splats_of_tile};
use super::{RenderContext, RenderMethod, Round};
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Pixel, Splat, Tile};
use crate::findings::Findings;
use crate::light::EmissionSampler;
use crate::memory::{Arena, Footprint, MemorySource, OutOfMemory};
use crate::transport::Counters;
use crate::transport::metropolis::bootstrap::{Bootstrap, CANDIDATES, Lengths};
use crate::transport::metropolis::chain::{Chains, ChainsOutput, Steps, room};
use crate::transport::metropolis::lanes::LANES;
use crate::transport::metropolis::paths::Paths;
use crate::transport::metropolis::split::{CELL, MAX_SEGMENTS, Split};
use crate::transport::metropolis::target::Target;

mod pilot;
mod plan;
mod settings;

pub use crate::transport::metropolis::split::PrimarySpace;
pub use settings::{ChainUse, MetropolisSettings};

use plan::{LONGEST, Plan};

/// Sums over samples, for [`ChainUse`].
#[derive(Clone, Copy, Default)]
struct Totals {
    samples: u32,
    brightness: f64,
    squares: f64,
    proposed: [u64; 3],
    accepted: [u64; 3],
}

/// A picture by Metropolis light transport.
pub struct Metropolis<'a, F> {
    context: RenderContext<'a>,
    emission: EmissionSampler<'a>,
    split: Split<'a>,
    lengths: Lengths,
    plan: Plan,
    densities: &'a mut [f32],
    starts: &'a mut [u32],
    splats: &'a mut [Splat],
    outputs: &'a mut [ChainsOutput],
    /// Splats of the sample, in the order of the film.
    picture: &'a mut [[f32; 3]],
    /// The sample whose splats they are.
    traced: Option<u32>,
    totals: Totals,
    features: core::marker::PhantomData<F>,
}

impl<'a, F: Features> Metropolis<'a, F> {
    /// Working memory of a worker.
    pub fn scratch() -> Footprint {
        let pilot = Footprint::default().slice::<Pixel>(PIXELS_PER_TILE).and(Paths::<F>::scratch());
        Chains::<F>::scratch(LONGEST).or(Bootstrap::<F>::scratch()).or(pilot)
    }

    /// Memory for a picture of `size` in a scene of so many lights.
    pub(super) fn usual_footprint(
        [width, height]: [u32; 2],
        lights: usize,
        settings: &MetropolisSettings,
    ) -> Footprint {
        let pixels = Tile::count(width, height) * PIXELS_PER_TILE;
        let points = (width as usize * height as usize).saturating_mul(settings.mutations.max(1) as usize);
        let splats = Footprint::default().slice::<[f32; 3]>(pixels).slice::<f32>(pixels / CELL);
        EmissionSampler::footprint(lights).and(splats).and(Plan::new(points).footprint())
    }

    /// Metropolis light transport of `context`, with fewer chains where memory is short, leaving `others`
    /// bytes.
    ///
    /// # Errors
    /// [`OutOfMemory`] where there is no memory for 128 chains, or too little scratch.
    pub fn new(
        context: &RenderContext<'a>,
        settings: &MetropolisSettings,
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
        others: usize,
    ) -> Result<Self, OutOfMemory> {
        let RenderContext { ref lights, settings: paths, .. } = *context;
        let footprint = EmissionSampler::footprint(lights.count());
        let emission = context.emission(&mut memory.take("emission", footprint)?)?;
        let pixels = Tile::count(paths.width, paths.height) * PIXELS_PER_TILE;
        let footprint = Footprint::default().slice::<[f32; 3]>(pixels).slice::<f32>(pixels / CELL);
        let mut arena = memory.take("splats", footprint)?;
        let (picture, levels) = (arena.slice(pixels)?, arena.slice(pixels / CELL)?);
        let plan = Plan::new(context.pixels().saturating_mul(settings.mutations.max(1) as usize));
        let plan = plan.within(memory.available().saturating_sub(others));
        let mut arena = memory.take("chains", plan.footprint())?;
        let max_segments = match settings.space {
            PrimarySpace::Multiplexed => MAX_SEGMENTS.min(paths.max_depth),
            PrimarySpace::PathTracing => u32::MAX,
        };
        let mut method = Self {
            context: *context,
            emission,
            split: Split { levels: &[], threshold: 0.0, max_segments, space: settings.space },
            lengths: Lengths::new(3..=3, |_| 1.0),
            plan,
            densities: arena.slice(plan.candidates)?,
            starts: arena.slice(plan.chains)?,
            splats: arena.slice(plan.tasks() * room(plan.mutations))?,
            outputs: arena.slice(plan.tasks())?,
            picture,
            traced: None,
            totals: Totals::default(),
            features: core::marker::PhantomData,
        };
        method.pilot(levels, settings.threshold, executor)?;
        Ok(method)
    }

    fn target(&self) -> Target<'_, F> {
        let Self { context, emission, split, .. } = self;
        Target::new(context.scene_context(), emission, context.settings, *split)
    }

    fn paths(&self) -> Paths<'_, F> {
        let Self { context, emission, split, .. } = self;
        Paths::new(context.scene_context(), emission, context.settings, *split)
    }

    /// True if there is light that chains could find, and time for them.
    fn is_needed(&self) -> bool {
        let Self { context, lengths, plan, .. } = self;
        plan.chains > 0 && !context.lights.is_empty() && context.settings.max_depth >= lengths.first()
    }

    /// Evaluates the independent points of a sample. The work; `None` where the executor is over.
    fn bootstrap(
        &mut self,
        sample: u32,
        executor: &mut impl Executor,
    ) -> Result<Option<Counters>, OutOfMemory> {
        let densities = core::mem::take(&mut self.densities);
        let bootstrap = Bootstrap::new(self.target(), self.lengths, self.context.settings.seed, sample);
        let points = densities[..self.plan.candidates].chunks_mut(CANDIDATES);
        let passed = executor
            .pass(points, |task, densities, worker| bootstrap.run(task, &mut worker.scratch, densities));
        self.densities = densities;
        let Passed { counters, is_complete } = passed?;
        Ok(is_complete.then_some(counters))
    }

    /// Makes the splats of a sample. The work; `None` where the executor is over.
    fn chain_pass(
        &mut self,
        sample: u32,
        executor: &mut impl Executor,
    ) -> Result<Option<Counters>, OutOfMemory> {
        if !self.is_needed() {
            self.picture.fill([0.0; 3]);
            return Ok(Some(Counters::default()));
        }
        let Some(mut counters) = self.bootstrap(sample, executor)? else { return Ok(None) };
        let Self { context, emission, split, lengths, plan, .. } = *self;
        let Self { densities, starts, splats, outputs, picture, .. } = self;
        let (densities, starts) = (&densities[..plan.candidates], &mut starts[..plan.chains]);
        let outputs = &mut outputs[..plan.tasks()];
        let (pixels, seed) = (picture.len(), context.settings.seed);
        let target = Target::<F>::new(context.scene_context(), &emission, context.settings, split);
        let bootstrap = Bootstrap::new(target, lengths, seed, sample);
        let brightness = bootstrap.choose(densities, starts);
        self.totals.add(brightness);
        if brightness == 0.0 {
            picture.fill([0.0; 3]);
            return Ok(Some(counters));
        }
        let visits = plan.chains as f64 * plan.mutations as f64;
        let scale = (brightness * context.pixels() as f64 / visits) as f32;
        let chains = Chains::new(bootstrap, (seed, sample), pixels, plan.mutations as u32, scale);
        let room = room(plan.mutations);
        let tasks = starts.chunks(LANES).zip(splats.chunks_mut(room)).zip(outputs.iter_mut());
        let passed = executor.pass(tasks, |task, ((starts, splats), output), worker| {
            chains.run(task, starts, &mut worker.scratch, splats, output)
        })?;
        if !passed.is_complete {
            return Ok(None);
        }
        counters += passed.counters;
        let (splats, outputs) = (&**splats, &*outputs);
        outputs.iter().for_each(|output| self.totals.count(&output.steps));
        let lists = splats.chunks(room).zip(outputs.iter().map(|output| &output.offsets));
        Ok(add_splats(executor, picture, lists)?.then_some(counters))
    }

    /// Use of chains so far.
    pub fn chains(&self) -> ChainUse {
        let Plan { candidates, chains, mutations } = self.plan;
        let Totals { samples, brightness, squares, proposed, accepted } = self.totals;
        let count = f64::from(samples.max(1));
        let share = brightness / count;
        let variance = (squares / count - share * share).max(0.0) / (count - 1.0).max(1.0);
        let ratio = |kind: usize| accepted[kind] as f64 / proposed[kind].max(1) as f64;
        ChainUse {
            chains: chains as u32,
            mutations: mutations as u32,
            candidates: candidates as u32,
            accepted: [0, 1, 2].map(ratio),
            share,
            share_error: if share > 0.0 { libm::sqrt(variance) / share } else { 0.0 },
        }
    }
}

impl Totals {
    fn add(&mut self, brightness: f64) {
        self.samples += 1;
        self.brightness += brightness;
        self.squares += brightness * brightness;
    }

    fn count(&mut self, steps: &[Steps; 3]) {
        for (kind, steps) in steps.iter().enumerate() {
            self.proposed[kind] += u64::from(steps.proposed);
            self.accepted[kind] += u64::from(steps.accepted);
        }
    }
}

impl<F: Features> RenderMethod for Metropolis<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        while let Some(sample) = round.next_sample() {
            // A round that ended within a sample has left its splats.
            if self.traced != Some(sample) {
                self.traced = None;
                let traced = round.executor.timed("chains", |executor| self.chain_pass(sample, executor))?;
                let Some(counters) = traced else { return Ok(()) };
                round.state.counters += counters;
                self.traced = Some(sample);
            }
            let (paths, picture) = (self.paths(), &*self.picture);
            round.tiles(sample + 1, |tile, samples, scratch: &mut Arena, pixels| {
                paths.run(tile, samples, splats_of_tile(picture, tile), scratch, pixels)
            })?;
        }
        Ok(())
    }

    fn findings(&self) -> Findings {
        Findings::from(self.chains().finding())
    }
}

#[cfg(test)]
mod tests;
