//! Irradiance at points of a scene, each value with its interval: memory, threads, time and stop rules around
//! [`halflight_core::IrradianceRenderer`].

mod points;
mod table;

pub use points::{Sensor, read_sensors, vertices};
pub use table::{Quantity, TableFormat, write_table};

use crate::render::{Built, BuiltMemory, Pool, RenderError, Stop, with_points};
use core::sync::atomic::AtomicBool;
use halflight_core::scene::Scene;
use halflight_core::transport::Counters;
use halflight_core::{IrradiancePoint, Level, LightPart, PointIrradiance};

/// Settings of irradiance at points.
#[derive(Clone, Debug)]
pub struct BakeSettings {
    /// Stop rules; the first that holds ends the work. An error is the half-width of the intervals of 95 % of
    /// the points of each tile of near points, relative to the value and a tenth of the mean.
    pub stop: Stop,
    /// Light to estimate.
    pub light: LightPart,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Most segments of a path; 2 is direct light. `None`: no limit.
    pub max_depth: Option<u32>,
    /// Number of threads; `None`: all of the machine.
    pub threads: Option<usize>,
    /// Memory limit in bytes for the scene and all structures; `None`: no limit.
    pub memory: Option<usize>,
    /// Instruction set of the kernels.
    pub level: Level,
}

impl BakeSettings {
    /// Rules without a flag: intervals of 2 %, or a minute.
    pub const SENSIBLE: Stop = Stop { spp: None, seconds: Some(60.0), error: Some(0.02) };
}

impl Default for BakeSettings {
    fn default() -> Self {
        Self {
            stop: Self::SENSIBLE,
            light: LightPart::All,
            seed: 0,
            max_depth: None,
            threads: None,
            memory: None,
            level: Level::detect(),
        }
    }
}

/// Progress of a bake.
#[derive(Clone, Copy, Debug)]
pub struct BakeProgress {
    /// Samples of the least sampled point.
    pub samples: u32,
    /// Tiles of near points, and those within the error.
    pub tiles: [usize; 2],
    /// Seconds so far.
    pub seconds: f64,
    /// Seconds left of the time limit.
    pub seconds_left: Option<f64>,
}

/// Irradiance of all points.
#[derive(Clone, Debug)]
pub struct Baked {
    /// Values, in the order of the points.
    pub values: Vec<PointIrradiance>,
    /// Tiles of near points, and those within the error.
    pub tiles: [usize; 2],
    /// Rays and rejected samples.
    pub counters: Counters,
    /// Seconds of building and of sampling.
    pub seconds: [f64; 2],
    /// True if the user ended the work.
    pub is_interrupted: bool,
}

impl Baked {
    /// Mean irradiance over all points, linear sRGB.
    pub fn mean(&self) -> [f64; 3] {
        let sum = self.values.iter().map(|value| value.irradiance.as_dvec3()).sum::<glam::DVec3>();
        (sum / self.values.len().max(1) as f64).to_array()
    }

    /// Median of the half-widths of the intervals relative to the value; `None` where most points are black
    /// or have no interval.
    pub fn median_half_width(&self) -> Option<f64> {
        let relative = |value: &PointIrradiance| (value.upper - value.value()) / value.value();
        let mut widths: Vec<f32> = self.values.iter().map(relative).collect();
        widths.sort_unstable_by(f32::total_cmp);
        let median = widths.get(widths.len() / 2).copied()?;
        median.is_finite().then_some(median.into())
    }
}

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
