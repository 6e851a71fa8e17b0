//! Choice of a method by predicted error: a [`Table`] of candidates, each with its prediction, of which the
//! first is chosen that no other undercuts by enough. Predictions are those of a [`Trial`] of paths and
//! records, of the pilot of [`super::counts`] and of a [`MethodPilot`] of progressive photon mapping. Work is
//! counted in rays and not in seconds: the choice follows from scene, settings, seed, memory and, where time
//! is limited, the number of threads.

mod gains;
mod goal;
mod method_pilot;
mod prediction;
mod table;
mod trial;

pub use gains::NoiseGains;
pub use goal::Goal;
pub use method_pilot::MethodPilot;
pub use prediction::ROWS;
pub use table::{Row, Table};
pub use trial::{Trial, TrialCaches};

use super::sppm::ProgressivePhotonMapping;
use crate::bsdf::Features;
use crate::memory::Footprint;

/// Working memory of a worker for the trial and the pilots.
pub fn scratch<F: Features>() -> Footprint {
    trial::scratch::<F>().or(ProgressivePhotonMapping::<F>::scratch())
}

#[cfg(test)]
mod tests;
