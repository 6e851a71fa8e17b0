//! Noise that a reconstruction of the picture takes away. It reduces the noise of samples, which the halves
//! of the film do not share; the noise of records and the blur of density estimates stay.

use crate::method::tuned::{GAIN_BESIDE_PHOTONS, GAIN_OF_SAMPLES};

/// Factors by which the noise of samples falls, one or more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseGains {
    /// Factor of samples by any method.
    pub samples: f64,
    /// Factor of samples beside records and caustic photons.
    pub beside_photons: f64,
}

impl NoiseGains {
    /// A picture that stays as it is.
    pub const NONE: Self = Self { samples: 1.0, beside_photons: 1.0 };

    /// A picture that is reconstructed.
    pub const OF_RECONSTRUCTION: Self =
        Self { samples: GAIN_OF_SAMPLES, beside_photons: GAIN_BESIDE_PHOTONS };

    /// Factor of the light that no record supplies.
    pub fn beside_records(&self, has_photons: bool) -> f64 {
        if has_photons { self.beside_photons } else { self.samples }
    }
}

impl Default for NoiseGains {
    fn default() -> Self {
        Self::NONE
    }
}
