//! End of a picture, and the pilots that it affords.

use crate::method::counts::pilot;
use crate::method::tuned::{
    COUNTS_FEWEST_PIXELS, COUNTS_RAYS_OF_PIXEL, COUNTS_SHARE_OF_PIXELS, RAYS_PER_SAMPLE, SAMPLES_OF_PILOTS,
    TRIAL_RAYS, TRIAL_SHARE,
};

/// Samples of a pixel in a trial.
pub(super) const SAMPLES: u32 = 4;

/// End of a picture: the first of these that holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// Rays for which there is time.
    pub rays: Option<f64>,
    /// Samples per pixel of path tracing; of other methods as many as take the same work.
    pub samples: Option<u32>,
    /// relMSE.
    pub error: Option<f64>,
}

impl Goal {
    /// Rays of a picture that time alone ends. A film by samples or error must find the same decisions again
    /// when it is resumed.
    pub fn rays_alone(&self) -> Option<f64> {
        self.rays.filter(|_| self.samples.is_none() && self.error.is_none())
    }

    /// Whether there is time for pilots beside the first samples of `pixels` pixels.
    pub fn affords_pilots(&self, pixels: usize) -> bool {
        self.rays.is_none_or(|rays| rays > SAMPLES_OF_PILOTS * RAYS_PER_SAMPLE * pixels as f64)
    }

    /// Whether a trial costs little beside a picture of `pixels` pixels.
    pub fn affords_trial(&self, pixels: usize) -> bool {
        let samples = self.samples.map(|samples| f64::from(samples) * pixels as f64 * RAYS_PER_SAMPLE);
        let rays = [self.rays, samples].into_iter().flatten().fold(f64::INFINITY, f64::min);
        rays > TRIAL_RAYS / TRIAL_SHARE && self.affords_pilots(pixels)
    }

    /// Pixels of a picture of `pixels` for each of the pilot of light paths: few where time alone ends it.
    pub fn part_of_pilot(&self, pixels: usize) -> usize {
        let Some(rays) = self.rays_alone() else { return pilot::PART };
        let few = (COUNTS_SHARE_OF_PIXELS * rays / COUNTS_RAYS_OF_PIXEL).max(COUNTS_FEWEST_PIXELS);
        ((pixels as f64 / few) as usize).max(1)
    }
}
