//! Sampling of all lights of a scene, from surfaces and as the start of light paths.

mod area;
mod border;
mod build;
mod choice;
mod delta;
mod disc;
mod emission;
mod emitted;
mod environment;
mod environment_visibility;
mod sampler;
mod tree;

pub(crate) use choice::ChosenLight;
pub(crate) use emission::LightType;
pub use emission::{DIMENSIONS as EMISSION_DIMENSIONS, EmissionSample, EmissionSampler, Focus, GuideStats};
pub use emitted::emitted;
pub use environment_visibility::{
    Bins, EnvironmentVisibility, VisibilityGrid, VisibilityTable, WarpedSample,
};
pub use sampler::{LightPoint, LightSample, LightSampler};

use crate::Rgb;
use halflight_simd::kernels::jumps::LUMINANCE;

/// Relative luminance of linear sRGB (BT.709).
#[inline]
pub fn luminance(color: Rgb) -> f32 {
    color.dot(Rgb::from_array(LUMINANCE))
}
