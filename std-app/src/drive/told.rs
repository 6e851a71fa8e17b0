//! What a picture tells of its error at some time: its noise, and its bias by an audit or by what photons blur.

use super::audit::{Audit, Audited};
use super::canvas::Canvas;
use super::workers::Workers;
use super::{Blurred, ErrorEstimate};

/// What is known of the error of a picture.
pub(super) struct Told {
    /// Noise alone.
    pub(super) noise: Option<ErrorEstimate>,
    /// Noise and bias, where there is an audit.
    pub(super) audited: Option<Audited>,
    /// Noise and blur, where photons blur and nobody audits.
    pub(super) blurred: Option<Blurred>,
}

impl Told {
    pub(super) fn of(workers: &Workers, canvas: &Canvas, audit: Option<&Audit>) -> Self {
        Self::by(workers, canvas, |noise| audit?.verdict(workers, &canvas.film, noise))
    }

    /// With what an audit says to the noise.
    pub(super) fn by(
        workers: &Workers,
        canvas: &Canvas,
        audit: impl FnOnce(ErrorEstimate) -> Option<Audited>,
    ) -> Self {
        let noise = workers.estimate(&canvas.film, canvas.shares);
        let mut audited = noise.and_then(audit);
        let is_blurred = audited.as_ref().is_none_or(|audited| audited.has_photons);
        let blurred = if is_blurred { Blurred::of(workers, &canvas.film, noise) } else { None };
        let blurred = match &mut audited {
            Some(audited) => {
                let all = |blurred: Blurred| audited.total.with_bias(blurred.blur);
                audited.total = blurred.map_or(audited.total, all);
                None
            }
            None => blurred,
        };
        Self { noise, audited, blurred }
    }

    /// All of it.
    pub(super) fn error(&self) -> Option<ErrorEstimate> {
        let audited = self.audited.as_ref().map(|audited| audited.total);
        audited.or(self.blurred.map(|blurred| blurred.total)).or(self.noise)
    }
}
