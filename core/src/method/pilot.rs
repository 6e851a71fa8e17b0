//! Pilots on a few tiles before the picture: its mean radiance, and the gain by path reuse.

use super::executor::Executor;
use super::tuned::{LEAST_PILOT, PILOT_RAYS, PILOT_SHARE};
use crate::bsdf::Features;
use crate::memory::{Arena, OutOfMemory};
use crate::transport::{Counters, LightEstimator, PathIntegrator, Pilot, path::WAVE};

/// Tiles of a pilot of usual size.
pub const PILOT_TILES: usize = 16;

/// Size of pilots relative to the usual one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotSize(f64);

impl PilotSize {
    /// Usual size.
    pub const USUAL: Self = Self(1.0);

    /// Size for a picture of this number of `rays`: pilots are smaller where there is little time.
    pub fn of_picture(rays: f64) -> Self {
        Self((PILOT_SHARE * rays / PILOT_RAYS).clamp(LEAST_PILOT, 1.0))
    }

    /// The part of a `usual` number that this size has, one or more.
    pub fn of(&self, usual: usize) -> usize {
        ((self.0 * usual as f64) as usize).max(1)
    }

    /// Tiles of a pilot.
    pub fn tiles(&self) -> usize {
        self.of(PILOT_TILES)
    }
}

/// The mean radiance of the picture.
///
/// # Errors
/// [`OutOfMemory`] where scratch has less than [`PathIntegrator::scratch_with`] bytes.
pub fn mean_radiance<F: Features, E: LightEstimator<F>>(
    integrator: &PathIntegrator<F, E>,
    size: PilotSize,
    executor: &mut impl Executor,
) -> Result<f32, OutOfMemory> {
    mean((integrator, size), executor, |tile, arena| integrator.pilot_mean(tile, WAVE, arena))
}

/// The mean radiance without what the photons of [`PathIntegrator::with_caustics`] bring.
///
/// # Errors
/// Those of [`mean_radiance`].
pub fn mean_radiance_without_photons<F: Features, E: LightEstimator<F>>(
    integrator: &PathIntegrator<F, E>,
    size: PilotSize,
    executor: &mut impl Executor,
) -> Result<f32, OutOfMemory> {
    mean((integrator, size), executor, |tile, arena| integrator.pilot_rest(tile, WAVE, arena))
}

fn mean<F: Features, E: LightEstimator<F>>(
    of: (&PathIntegrator<F, E>, PilotSize),
    executor: &mut impl Executor,
    of_tile: impl Fn(usize, &mut Arena) -> Result<f32, OutOfMemory> + Sync,
) -> Result<f32, OutOfMemory> {
    let mut means = [None; PILOT_TILES];
    for_each_tile(of, executor, &mut means, of_tile)?;
    let count = means.iter().flatten().count();
    Ok(means.iter().flatten().sum::<f32>() / count.max(1) as f32)
}

/// Variance and work of samples with path reuse and without, in a picture of about `mean` radiance.
///
/// # Errors
/// Those of [`mean_radiance`].
pub fn variance<F: Features, E: LightEstimator<F>>(
    integrator: &PathIntegrator<F, E>,
    (mean, size): (f32, PilotSize),
    executor: &mut impl Executor,
) -> Result<Pilot, OutOfMemory> {
    let mut pilots = [None; PILOT_TILES];
    for_each_tile((integrator, size), executor, &mut pilots, |tile, arena| {
        integrator.pilot(tile, mean, WAVE, arena)
    })?;
    let mut pilot = Pilot::default();
    pilots.into_iter().flatten().for_each(|tile| pilot += tile);
    Ok(pilot)
}

/// Fills `out` with the values of the pilot's tiles; those that the executor did not come to stay `None`.
fn for_each_tile<F: Features, E: LightEstimator<F>, T: Send>(
    (integrator, size): (&PathIntegrator<F, E>, PilotSize),
    executor: &mut impl Executor,
    out: &mut [Option<T>; PILOT_TILES],
    of_tile: impl Fn(usize, &mut Arena) -> Result<T, OutOfMemory> + Sync,
) -> Result<(), OutOfMemory> {
    let tiles = integrator.pilot_tasks(size.tiles()).zip(out.iter_mut());
    let _ = executor.pass(tiles, |_, (tile, out), worker| {
        *out = Some(of_tile(tile, &mut worker.scratch)?);
        Ok(Counters::default())
    })?;
    Ok(())
}
