//! Irradiance at points of a scene, each value with its interval: memory, threads, time and stop rules around
//! [`halflight_core::IrradianceRenderer`]. [`crate::Renderer::irradiance_at`] needs a loaded scene
//! and [`Sensor`]s alone.

mod attachment;
mod charts;
mod grid;
mod ktx2;
mod lightmap;
mod map;
mod merge;
mod points;
mod probe_files;
mod probes;
mod raster;
mod seams;
mod stitch;
mod table;
mod tilted;

pub use crate::render::{BakeProgress, BakeSettings, Baked};
pub use attachment::{BakeSubject, attachment};
pub use halflight_core::IrradiancePoint;
pub use lightmap::{DirectionalLayout, Lightmap, LightmapError, LightmapSettings};
pub use map::{LightMap, Texel, check as check_format};
pub use merge::{MergedBake, is_bake, merge};
pub use points::{Sensor, read_sensors, vertices};
pub use probe_files::{ProbeFormat, write_probes};
pub use probes::{Probe, ProbeGrid, ProbeSettings};
pub use raster::Watch;
pub use table::{Quantity, TableFormat, write_table};

use crate::memory::Budget;
use crate::render::{Built, BuiltMemory, Pool, RenderError, scene_bytes, with_points};
use core::sync::atomic::AtomicBool;
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

/// The memory that `scene` leaves of `limit` bytes; `None`: of four fifths of the machine.
pub fn budget(scene: &Scene, limit: Option<usize>) -> Budget {
    let mut budget = Budget::new(limit);
    // A scene that fills the limit leaves nothing.
    let _ = budget.take(scene_bytes(scene).min(budget.left()));
    budget
}
