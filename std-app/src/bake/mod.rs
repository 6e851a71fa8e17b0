//! Irradiance at points of a scene, each value with its interval: memory, threads, time and stop rules around
//! [`halflight_core::IrradianceRenderer`].

mod points;
mod table;

pub use crate::render::{BakeProgress, BakeSettings, Baked};
pub use points::{Sensor, read_sensors, vertices};
pub use table::{Quantity, TableFormat, write_table};

use crate::render::{Built, BuiltMemory, Pool, RenderError, with_points};
use core::sync::atomic::AtomicBool;
use halflight_core::IrradiancePoint;
use halflight_core::scene::Scene;

/// Estimates the irradiance of `points` until a rule of `settings.stop` holds or `interrupt` is raised.
/// [`crate::Renderer::irradiance`] estimates several sets of points with one build.
///
/// # Errors
/// No point or more than 2^30; insufficient memory; no threads.
pub fn irradiance(
    scene: &Scene,
    points: &[IrradiancePoint],
    settings: &BakeSettings,
    progress: &mut dyn FnMut(&BakeProgress),
    interrupt: &AtomicBool,
) -> Result<Baked, RenderError> {
    let (pool, owner) = (Pool::new(settings.threads)?, BuiltMemory::default());
    let built = Built::new(scene, (settings.level, settings.memory), &pool, &owner)?;
    with_points((scene, &built), (points, settings), &pool, progress, interrupt)
}
