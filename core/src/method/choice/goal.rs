//! End of a picture, and the trial that it affords.

/// Fewest and most samples of a pixel in a trial, and its fraction of the work between them. An end by error
/// is an unknown amount of work.
const SAMPLES: u32 = 4;
const MOST_SAMPLES: u32 = 32;
const SHARE: f64 = 0.02;

/// Rays of a trial of [`SAMPLES`], its greatest fraction of the work, and rays of a sample before a trial has
/// counted them.
const TRIAL_RAYS: f64 = 2.5e5;
const TRIAL_SHARE: f64 = 0.25;
const RAYS_PER_SAMPLE: f64 = 8.0;

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
    /// Whether there is time for pilots beside the first samples of `pixels` pixels.
    pub fn affords_pilots(&self, pixels: usize) -> bool {
        self.rays.is_none_or(|rays| rays > FEWEST_SAMPLES * RAYS_PER_SAMPLE * pixels as f64)
    }

    /// Whether a trial costs little beside a picture of `pixels` pixels.
    pub fn affords_trial(&self, pixels: usize) -> bool {
        self.most_rays(pixels) > TRIAL_RAYS / TRIAL_SHARE && self.affords_pilots(pixels)
    }

    /// Rays of a picture of `pixels` pixels that ends by time or samples; infinite for others.
    fn most_rays(&self, pixels: usize) -> f64 {
        let samples = self.samples.map(|samples| f64::from(samples) * pixels as f64 * RAYS_PER_SAMPLE);
        [self.rays, samples].into_iter().flatten().fold(f64::INFINITY, f64::min)
    }

    /// Samples of a pixel in the trial of a picture of `pixels` pixels, a multiple of [`SAMPLES`].
    pub(super) fn trial_samples(&self, pixels: usize) -> u32 {
        let trials = SHARE * self.most_rays(pixels) / TRIAL_RAYS;
        match self.error {
            Some(_) => SAMPLES,
            None => (SAMPLES * trials.max(1.0) as u32).min(MOST_SAMPLES),
        }
    }
}
