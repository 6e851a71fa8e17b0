//! Noise that a reconstruction of the picture takes away. It reduces the noise of samples, which its halves
//! do not share; the noise of records and the blur of density estimates stay.

use super::MethodPilot;
use crate::method::tuned::{GAIN_BESIDE_RECORDS, GAIN_OF_LIGHT_PATHS, GAIN_OF_PATHS, GAIN_OF_PHOTONS};

/// Factors by which the noise of samples falls, one or more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseGains {
    /// By path tracing.
    pub paths: f64,
    /// Of the light that no record supplies, beside records.
    pub beside_records: f64,
    /// By light paths and connections.
    pub light_paths: f64,
    /// By progressive photons.
    pub photons: f64,
}

impl NoiseGains {
    /// A picture that stays as it is.
    pub const NONE: Self = Self { paths: 1.0, beside_records: 1.0, light_paths: 1.0, photons: 1.0 };

    /// A picture that is reconstructed.
    pub const OF_RECONSTRUCTION: Self = Self {
        paths: GAIN_OF_PATHS,
        beside_records: GAIN_BESIDE_RECORDS,
        light_paths: GAIN_OF_LIGHT_PATHS,
        photons: GAIN_OF_PHOTONS,
    };
}

impl Default for NoiseGains {
    fn default() -> Self {
        Self::NONE
    }
}

impl MethodPilot {
    /// With so much less noise, and the same blur.
    pub fn reduced(self, gain: f64) -> Self {
        Self { noise: self.noise / gain, ..self }
    }
}
