//! End of a picture, and the pilots that it affords.

use crate::method::counts::pilot;

/// Samples of a pixel in a trial.
pub(super) const SAMPLES: u32 = 4;

/// Rays of a trial of [`SAMPLES`], its greatest fraction of the work, and rays of a sample before a trial has
/// counted them.
const TRIAL_RAYS: f64 = 2.5e5;
const TRIAL_SHARE: f64 = 0.25;
const RAYS_PER_SAMPLE: f64 = 8.0;

/// Work of a pixel of the pilot, and the fraction of the work that its pixels may take where it is larger.
const RAYS_OF_PILOT_PIXEL: f64 = 300.0;
const PILOT_PIXELS: f64 = 0.02;

/// Fewest pixels of the pilot of counts where time alone ends the picture.
const FEWEST_PILOT_PIXELS: f64 = 512.0;

/// Fewest samples of a pixel for which pilots gain more than they cost.
const FEWEST_SAMPLES: f64 = 4.0;

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
        self.rays.is_none_or(|rays| rays > FEWEST_SAMPLES * RAYS_PER_SAMPLE * pixels as f64)
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
        let few = (PILOT_PIXELS * rays / RAYS_OF_PILOT_PIXEL).max(FEWEST_PILOT_PIXELS);
        ((pixels as f64 / few) as usize).max(1)
    }
}
