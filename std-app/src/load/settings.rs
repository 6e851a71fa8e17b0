//! Render settings of a scene file; flags of the command line override them.

use serde::Deserialize;

/// Render settings; `None` if not given.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderSettings {
    /// Width and height in pixels.
    pub size: Option<[u32; 2]>,
    /// Samples per pixel.
    pub spp: Option<u32>,
    /// Rendering time limit, in seconds.
    pub time: Option<f64>,
    /// relMSE at which to stop.
    pub error: Option<f64>,
    /// Longest path, in segments; 1: directly visible light.
    pub max_depth: Option<u32>,
    /// Seed of all random numbers.
    pub seed: Option<u32>,
    /// Name of the method.
    pub method: Option<String>,
}
