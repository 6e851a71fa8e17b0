//! Error of an unaudited picture with photons: noise and photon blur.

use super::workers::Workers;
use super::{BiasEstimate, ErrorEstimate};
use halflight_core::film::Film;

/// Noise and blur of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseAndBlur {
    /// Noise of the picture, from its half-films.
    pub noise: ErrorEstimate,
    /// Squared bias by photon blur, estimated from the samples.
    pub blur: BiasEstimate,
    /// Sum of both.
    pub total: ErrorEstimate,
}

impl NoiseAndBlur {
    /// Error of `film` with known noise; `None` without blur.
    pub(super) fn of(workers: &Workers, film: &Film, noise: Option<ErrorEstimate>) -> Option<Self> {
        let (noise, blur) = noise.zip(workers.blur(film))?;
        Some(Self { noise, blur, total: noise.with_bias(blur) })
    }
}
