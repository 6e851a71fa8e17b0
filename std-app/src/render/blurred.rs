//! The error of a picture with photons that nobody audited: its noise, and what photons blur.

use super::workers::Workers;
use super::{BiasEstimate, ErrorEstimate};
use halflight_core::film::Film;

/// Noise and blur of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blurred {
    /// The error that the picture's own noise tells of.
    pub noise: ErrorEstimate,
    /// The square of what photons blur, as samples tell.
    pub blur: BiasEstimate,
    /// The sum of both.
    pub total: ErrorEstimate,
}

impl Blurred {
    /// Of `film`, whose noise is known; `None` where photons blur nothing.
    pub(super) fn of(workers: &Workers, film: &Film, noise: Option<ErrorEstimate>) -> Option<Self> {
        let (noise, blur) = noise.zip(workers.blur(film))?;
        Some(Self { noise, blur, total: noise.with_bias(blur) })
    }
}
