//! Stochastic progressive photon mapping (Hachisuka and Jensen 2009), with the radii of Knaus and Zwicker 2011: for each
//! sample of the picture photons are shot anew, paths from the eye end at the first surface with a diffuse part and
//! gather there, and radii shrink from sample to sample such that noise and blur both vanish:
//!
//! r² (i + 1) = r² (i) (i + a) / (i + 1), a = 2/3
//!
//! No pixel keeps anything but its sum, and memory is the same for any number of samples. Even and odd samples count
//! their radii apart, so that the halves of the film are two such pictures of their own.

use super::{Renderer, Stage};
use crate::drive::RenderError;
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::run::path_settings;
use halflight_core::bsdf::Features;
use halflight_core::light::Emission;
use halflight_core::memory::{Arena, Line};
use halflight_core::photon::Photons;
use halflight_core::transport::shoot::{PATHS, ROOM, ShootSettings, Shooter};
use halflight_core::transport::{PathTracer, PhotonLight, path::WAVE};

/// Radius of the discs of the first sample, in pixels.
const FIRST_RADIUS: f64 = 3.0;

/// How fast radii shrink, a: with 2/3 the variance and the squared bias fall alike, as n^(-2/3).
const ALPHA: f64 = 2.0 / 3.0;

/// Light paths for a sample: one for each pixel of the picture, but no fewer and no more than these.
const FEWEST_PATHS: usize = 16 * PATHS;
const MOST_PATHS: usize = 1024 * PATHS;

/// See the file.
pub(super) struct ProgressivePhotons<'a, F> {
    stage: Stage<'a>,
    tracer: PathTracer<'a, F>,
    paths: usize,
    photons: Vec<Line>,
    emission: Vec<Line>,
    scratch: Vec<Vec<Line>>,
}

impl<'a, F: Features> ProgressivePhotons<'a, F> {
    pub(super) fn new(stage: &Stage<'a>, memory: &mut Memory) -> Result<Self, RenderError> {
        let Stage { scene, bvh, lights, settings, workers } = *stage;
        let scratch = PathTracer::<F>::scratch(WAVE).or(Shooter::<F>::scratch());
        let scratch = memory.take_each("paths", scratch, workers.count())?;
        let emission = memory.take("emission", Emission::footprint(lights))?;
        let pixels = settings.width as usize * settings.height as usize;
        let wanted = pixels.clamp(FEWEST_PATHS, MOST_PATHS).div_ceil(PATHS);
        let of_task = Photons::footprint(ROOM).bytes();
        let tasks = wanted.min(memory.available() / 4 / of_task).max(1);
        let photons = memory.take("photons", Photons::footprint(tasks * ROOM))?;
        let tracer = PathTracer::<F>::new(scene, bvh, lights, path_settings(settings), settings.level);
        Ok(Self { stage: *stage, tracer, paths: tasks * PATHS, photons, emission, scratch })
    }
}

impl<F: Features> Renderer for ProgressivePhotons<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        let Self { stage, tracer, paths, photons, emission, scratch } = self;
        let Stage { scene, bvh, lights, settings, workers } = *stage;
        let bounds = bvh.bounds();
        let mut arena = Arena::new(bytemuck::cast_slice_mut(emission));
        let emission = Emission::build(scene, lights, &bounds, &mut arena)?;
        let shot = ShootSettings {
            seed: settings.seed,
            paths: *paths as u32,
            max_depth: path_settings(settings).max_depth,
        };
        let shooter = Shooter::<F>::new(scene, bvh, lights, &emission, shot, settings.level);
        let room = *paths / PATHS * ROOM;
        while let Some(sample) = crew.next_sample() {
            let mut map = Photons::new(room, &mut Arena::new(bytemuck::cast_slice_mut(photons)))?;
            let shoot = |task: usize, arena: &mut Arena, out: &mut [_]| shooter.run(task, sample, arena, out);
            if !crew.pass(map.as_mut_slice(), ROOM, scratch, &shoot)? {
                return Ok(());
            }
            let map = workers.build_photons(map, room);
            let pixels = FIRST_RADIUS * shrunk(sample / 2).sqrt();
            let light =
                PhotonLight::new(&map, &scene.camera, settings.height, bounds.diagonal(), pixels as f32);
            let tracer = tracer.with_photons(light);
            crew.tiles(sample + 1, scratch, &|task, samples, arena, pixels| {
                tracer.run(task, samples, WAVE, arena, pixels)
            })?;
        }
        Ok(())
    }
}

/// What is left of the squared radius after `samples`.
fn shrunk(samples: u32) -> f64 {
    (1..=samples).map(f64::from).fold(1.0, |squared, i| squared * (i + ALPHA) / (i + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_shrink_as_a_power_of_the_samples() {
        assert_eq!(shrunk(0), 1.0);
        assert!((shrunk(1) - (1.0 + ALPHA) / 2.0).abs() < 1e-12);
        // Γ(n + a) / (Γ(1 + a) Γ(n + 1)), which goes like n^(a - 1) / Γ(5/3).
        let expected = 64f64.powf(ALPHA - 1.0) / 0.902_745_293;
        assert!((shrunk(63) / expected - 1.0).abs() < 0.005, "{}", shrunk(63));
    }
}
