//! The error of a picture at some time: its noise, and its bias by an audit or by the blur of photons.

use super::audit::{Audit, Audited};
use super::workers::Workers;
use super::{Blurred, ErrorEstimate};
use halflight_core::method::RenderState;

/// The error of a picture in its parts.
pub(super) struct ErrorReport {
    /// Noise alone.
    pub(super) noise: Option<ErrorEstimate>,
    /// Noise and bias, where there is an audit.
    pub(super) audited: Option<Audited>,
    /// Noise and blur, where there are photons and no audit.
    pub(super) blurred: Option<Blurred>,
}

impl ErrorReport {
    /// With the verdict of `audit` on the noise.
    pub(super) fn new(workers: &Workers, state: &RenderState, audit: Option<&Audit>) -> Self {
        Self::with(workers, state, |noise| audit?.verdict(workers, &state.film, noise))
    }

    /// With the answer of `audit` to the noise.
    pub(super) fn with(
        workers: &Workers,
        state: &RenderState,
        audit: impl FnOnce(ErrorEstimate) -> Option<Audited>,
    ) -> Self {
        Self::of_noise(workers.estimate(&state.film, state.is_correlated), workers, state, audit)
    }

    /// The same for a picture whose `noise` is known.
    pub(super) fn of_noise(
        noise: Option<ErrorEstimate>,
        workers: &Workers,
        state: &RenderState,
        audit: impl FnOnce(ErrorEstimate) -> Option<Audited>,
    ) -> Self {
        let mut audited = noise.and_then(audit);
        // An audit without photons measures their blur as well, where it measures anything.
        let is_seen = audited.as_ref().is_some_and(|audited| !audited.has_photons && !audited.is_blind);
        let mut blurred = if is_seen { None } else { Blurred::of(workers, &state.film, noise) };
        if let Some(audited) = &mut audited
            && let Some(blurred) = blurred.take()
        {
            audited.total = audited.total.with_bias(blurred.blur);
        }
        Self { noise, audited, blurred }
    }

    /// The estimate with all parts.
    pub(super) fn error(&self) -> Option<ErrorEstimate> {
        let audited = self.audited.as_ref().map(|audited| audited.total);
        audited.or(self.blurred.map(|blurred| blurred.total)).or(self.noise)
    }
}
