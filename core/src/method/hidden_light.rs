//! Measure of the light that a method finds with no number of samples, by photons before the picture
//! (`transport/photon_mapping/hidden.rs`). Its absence is a bias that the noise of the picture does not show.

use super::caustics;
use super::executor::Executor;
use super::{PhotonMapStore, RenderContext};
use crate::bsdf::Features;
use crate::estimate::{ErrorEstimate, RELMSE_OFFSET};
use crate::light::{EmissionSampler, GuideStats};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::transport::photon_mapping::hidden::{
    HiddenLightTracer, PATHS_PER_TASK, Techniques, VERTICES_PER_TASK,
};
use crate::transport::photon_mapping::visible_points::VisiblePointSampler;

/// Light paths of each of two maps, in tasks, and the number of the first map, which no picture has.
const TASKS: usize = 32;
const FIRST_MAP: u32 = 0x7fff_fe00;

/// Radius of the kernels of photons, in pixels.
const RADIUS: f32 = 4.0;

/// Blocks of the picture across and down.
const SIDE: usize = 8;
const BLOCKS: usize = SIDE * SIDE;

/// Doubt of the measure, relative, beside the difference of both maps.
const DOUBT: f64 = 0.25;

/// Hidden radiance of a picture, mean of the channels in each block by each of two maps of photons.
#[derive(Clone, Debug, PartialEq)]
pub struct HiddenLight {
    blocks: [[f64; 2]; BLOCKS],
    /// Fraction of all other light that is found too seldom, wherever it is.
    rare: f64,
}

/// Fraction of the light that a picture has at least, for the ratio of rare to other light.
const LEAST_SEEN: f64 = 1e-4;

/// Light that a picture lacks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LackingLight {
    /// Its fraction of all light.
    pub share: f64,
    /// Squared error by its absence, relMSE.
    pub error: ErrorEstimate,
}

/// Radiance by block, while it is added up.
#[derive(Clone, Copy)]
struct Sums {
    light: [f64; BLOCKS],
    count: [f64; BLOCKS],
}

impl Default for Sums {
    fn default() -> Self {
        Self { light: [0.0; BLOCKS], count: [0.0; BLOCKS] }
    }
}

impl Sums {
    /// Adds the radiance of the pixel `at`, relative to the `frame`.
    fn add(&mut self, at: [f64; 2], frame: [u32; 2], light: f64) {
        let cell = |i: usize| ((at[i] / f64::from(frame[i]) * SIDE as f64) as usize).min(SIDE - 1);
        let block = cell(1) * SIDE + cell(0);
        self.light[block] += light;
        self.count[block] += 1.0;
    }

    fn means(&self) -> [f64; BLOCKS] {
        core::array::from_fn(|i| if self.count[i] > 0.0 { self.light[i] / self.count[i] } else { 0.0 })
    }
}

impl HiddenLight {
    /// Memory that [`HiddenLight::measure`] borrows for a picture of `size` in a scene of so many lights.
    pub fn footprint(lights: usize, size: [u32; 2]) -> Footprint {
        EmissionSampler::footprint(lights)
            .and(GuideStats::footprint(lights))
            .and(GuideStats::guide_footprint(lights))
            .slice::<f32>(VisiblePointSampler::new(size).rays())
            .and(PhotonMapStore::footprint(TASKS * VERTICES_PER_TASK))
    }

    /// Working memory of a worker.
    pub fn scratch<F: Features>() -> Footprint {
        HiddenLightTracer::<F>::scratch()
    }

    /// True if a method without photons may lack light of the scene.
    pub fn is_possible<F: Features>(context: &RenderContext) -> bool {
        caustics::are_possible(context.scene) && context.scene_context::<F>().has_hidden_light()
    }

    /// Light that a method with these `techniques` lacks; `None` without any, or where there is no memory to
    /// measure it.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is smaller than [`HiddenLight::scratch`].
    pub fn measure<'m, F: Features>(
        context: &RenderContext,
        techniques: Techniques,
        memory: &mut impl MemorySource<'m>,
        executor: &mut impl Executor,
    ) -> Result<Option<Self>, OutOfMemory> {
        let size = [context.settings.width, context.settings.height];
        let footprint = Self::footprint(context.lights.count(), size);
        if !Self::is_possible::<F>(context) || !memory.has(footprint) {
            return Ok(None);
        }
        let RenderContext { scene, lights, settings, .. } = *context;
        memory.lend("hidden light", footprint, |_, arena| {
            let by_power = context.emission(arena)?;
            let Some(stats) = GuideStats::aimed(scene, &lights, &by_power, arena)? else { return Ok(None) };
            let emission = stats.guide(&by_power, arena)?;
            let raster = raster(context);
            let light = arena.slice::<f32>(raster.rays())?;
            let paths = (TASKS * PATHS_PER_TASK) as u32;
            let scene = context.scene_context::<F>();
            let tracer = HiddenLightTracer::new(scene, &emission, (&settings, paths), techniques);
            let radii = context.radii().of_pixels(RADIUS);
            let mut store = PhotonMapStore::over(arena.scratch());
            let mut blocks = [[0.0; 2]; BLOCKS];
            for half in 0..2 {
                let size = (TASKS * VERTICES_PER_TASK, VERTICES_PER_TASK);
                let number = FIRST_MAP + half;
                let passed = store.fill(executor, size, |task, scratch, photons| {
                    tracer.run(task, number, scratch, photons)
                })?;
                let Some(map) = store.map()?.filter(|_| passed.is_complete) else { return Ok(None) };
                let pieces = light.chunks_mut(VisiblePointSampler::TASK);
                let passed = executor.pass(pieces, |task, light, _| {
                    let mut counters = crate::transport::Counters::default();
                    for (i, light) in light.iter_mut().enumerate() {
                        let ray = (task * VisiblePointSampler::TASK + i) as u32;
                        *light = tracer.along(&raster, (settings.seed, ray), (&map, radii), &mut counters);
                    }
                    Ok(counters)
                })?;
                if !passed.is_complete {
                    return Ok(None);
                }
                let mut sums = Sums::default();
                for (ray, light) in light.iter().enumerate() {
                    sums.add(raster.pixel(ray), [settings.width, settings.height], f64::from(*light));
                }
                for (block, mean) in blocks.iter_mut().zip(sums.means()) {
                    block[half as usize] = mean;
                }
            }
            let is_lacking = blocks.iter().flatten().any(|light| *light > 0.0);
            Ok(is_lacking.then_some(Self { blocks, rare: 0.0 }))
        })
    }

    /// A `rare` fraction of the light is found too seldom.
    pub fn of_rare(rare: f64) -> Self {
        Self { blocks: [[0.0; 2]; BLOCKS], rare }
    }

    /// This light, and a `rare` fraction of all other light.
    pub fn with_rare(self, rare: f64) -> Self {
        Self { rare, ..self }
    }

    /// Error of a picture of `frame` pixels that lacks this light, from its `pixels`: place and radiance,
    /// mean of the channels.
    pub fn lacking(&self, frame: [u32; 2], pixels: impl Iterator<Item = ([f64; 2], f64)>) -> LackingLight {
        let mut picture = Sums::default();
        pixels.for_each(|(at, light)| picture.add(at, frame, light));
        let seen = picture.means();
        let rest = self.rare / (1.0 - self.rare).max(LEAST_SEEN);
        let hidden: [f64; BLOCKS] =
            core::array::from_fn(|i| 0.5 * (self.blocks[i][0] + self.blocks[i][1]) + rest * seen[i]);
        let mean = |of: &dyn Fn(usize) -> f64| (0..BLOCKS).map(of).sum::<f64>() / BLOCKS as f64;
        let (lacks, has) = (mean(&|i| hidden[i]), mean(&|i| seen[i]));
        let all = lacks + has;
        // The product of both halves has no noise of its own.
        let square = mean(&|i| {
            let even = rest * seen[i];
            let square = (self.blocks[i][0] + even) * (self.blocks[i][1] + even);
            let scale = seen[i] * (seen[i] + 2.0 * hidden[i]) + square + RELMSE_OFFSET * all * all;
            if scale > 0.0 { square / scale } else { 0.0 }
        });
        let halves = [0, 1].map(|half| mean(&|i| self.blocks[i][half]));
        let doubt = 1.0 + DOUBT + (halves[0] - halves[1]).abs() / (2.0 * lacks).max(f64::MIN_POSITIVE);
        let (lower, upper) = (square / (doubt * doubt), square * (doubt * doubt));
        LackingLight {
            share: if all > 0.0 { lacks / all } else { 0.0 },
            error: ErrorEstimate { relmse: square, lower, upper },
        }
    }
}

impl LackingLight {
    /// Error of the picture with `noise` as well, which a black picture does not have.
    pub fn beside(&self, noise: Option<ErrorEstimate>) -> ErrorEstimate {
        let ErrorEstimate { relmse, lower, upper } = noise.unwrap_or(self.error);
        let Some(_) = noise else { return self.error };
        let own = self.error;
        ErrorEstimate { relmse: relmse + own.relmse, lower: lower + own.lower, upper: upper + own.upper }
    }
}

fn raster(context: &RenderContext) -> VisiblePointSampler {
    VisiblePointSampler::new([context.settings.width, context.settings.height])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of radiance `seen` in which `hidden` is missing everywhere.
    fn lacking(seen: f64, hidden: f64) -> LackingLight {
        let pixels = (0..1024).map(|i| ([f64::from(i % 32) + 0.5, f64::from(i / 32) + 0.5], seen));
        HiddenLight { blocks: [[hidden; 2]; BLOCKS], rare: 0.0 }.lacking([32, 32], pixels)
    }

    #[test]
    fn a_black_picture_lacks_all_light_and_has_its_whole_square_as_error() {
        let LackingLight { share, error } = lacking(0.0, 2.0);
        assert_eq!(share, 1.0);
        assert!((error.relmse - 1.0 / (1.0 + RELMSE_OFFSET)).abs() < 1e-12, "{error:?}");
    }

    #[test]
    fn rare_light_is_a_fraction_of_all_light() {
        let pixels = (0..1024).map(|i| ([f64::from(i % 32) + 0.5, f64::from(i / 32) + 0.5], 3.0));
        let lacks = HiddenLight::of_rare(0.25).lacking([32, 32], pixels);
        assert!((lacks.share - 0.25).abs() < 1e-12, "{lacks:?}");
    }

    #[test]
    fn the_error_is_the_square_of_the_share_beside_the_noise() {
        let lacks = lacking(3.0, 1.0);
        assert_eq!(lacks.share, 0.25);
        let expected = 1.0 / (16.0 * (1.0 + RELMSE_OFFSET));
        assert!((lacks.error.relmse - expected).abs() < 1e-12);
        let noise = ErrorEstimate { relmse: 0.5, lower: 0.25, upper: 1.0 };
        let ErrorEstimate { relmse, lower, upper } = lacks.beside(Some(noise));
        assert!((relmse - 0.5 - expected).abs() < 1e-12 && lower < relmse && upper > relmse);
    }
}
