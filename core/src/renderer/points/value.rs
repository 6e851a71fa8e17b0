//! Settings of irradiance at points, and its values.

use crate::film::Pixel;
use crate::light::luminance;
use crate::method::choice::Goal;
use crate::method::{PointMethod, Shard};
use crate::transport::LightPart;
use crate::{Level, Rgb};

/// Settings of irradiance at points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSettings {
    /// Seed of all random numbers.
    pub seed: u32,
    /// Most segments of a path; 2 is direct light. `None`: no limit.
    pub max_depth: Option<u32>,
    /// Highest instruction set to use, by default that of [`Level::detect`]. The bits are the same by all.
    pub level: Level,
    /// Part of the points to estimate, in tiles of 256 near points.
    pub shard: Shard,
    /// Light to estimate.
    pub light: LightPart,
    /// Caustic photons where a pilot finds that they pay.
    pub caustics: bool,
    /// Source of the indirect light.
    pub method: PointMethod,
    /// End of the bake, by which [`PointMethod::Auto`] chooses: its error is the relative half-width of
    /// intervals.
    pub goal: Goal,
}

impl Default for PointSettings {
    fn default() -> Self {
        Self {
            seed: 0,
            max_depth: None,
            level: Level::detect(),
            shard: Shard::WHOLE,
            light: LightPart::All,
            caustics: true,
            method: PointMethod::Path,
            goal: Goal::default(),
        }
    }
}

/// Irradiance of a point and its interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointIrradiance {
    /// Irradiance in W/m² on the side of the normal.
    pub irradiance: Rgb,
    /// Lower end of the 95 % interval of its luminance.
    pub lower: f32,
    /// Upper end of that interval; infinite below two samples.
    pub upper: f32,
    /// Number of samples.
    pub samples: u32,
}

impl PointIrradiance {
    /// Luminance of the irradiance.
    pub fn value(&self) -> f32 {
        luminance(self.irradiance)
    }
}

impl PointIrradiance {
    /// Mean of the replicates of a point at these `places` of the film.
    pub(super) fn of_replicates(places: &[u32], pixels: &[Pixel], half_widths: &[f32]) -> Self {
        let (mut sum, mut squares, mut samples) = (Rgb::ZERO, 0.0, 0);
        for &place in places {
            let pixel = pixels.get(place as usize).copied().unwrap_or_default();
            let half_width = half_widths.get(place as usize).copied().unwrap_or(f32::INFINITY);
            sum += pixel.mean();
            squares += half_width * half_width;
            samples += pixel.count();
        }
        let count = places.len().max(1) as f32;
        let (irradiance, half_width) = (sum / count, libm::sqrtf(squares) / count);
        let value = luminance(irradiance);
        Self { irradiance, lower: (value - half_width).max(0.0), upper: value + half_width, samples }
    }
}
