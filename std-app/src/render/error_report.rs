//! Error of a picture: noise, plus bias by an audit or by photon blur.

use super::audit::{Audit, Audited};
use super::workers::Workers;
use super::{Blurred, ErrorEstimate};
use halflight_core::method::RenderState;

/// Error of a picture in its parts.
pub(super) struct ErrorReport {
    /// Noise alone.
    pub(super) noise: Option<ErrorEstimate>,
    /// Noise and bias, if there is an audit.
    pub(super) audited: Option<Audited>,
    /// Noise and blur, if there are photons and no audit.
    pub(super) blurred: Option<Blurred>,
}

impl ErrorReport {
    /// Report with the result of `audit`.
    pub(super) fn new(workers: &Workers, state: &RenderState, audit: Option<&Audit>) -> Self {
        Self::with(workers, state, |noise| audit?.verdict(workers, &state.film, noise))
    }

    /// Report with the result of calling `audit` on the noise.
    pub(super) fn with(
        workers: &Workers,
        state: &RenderState,
        audit: impl FnOnce(ErrorEstimate) -> Option<Audited>,
    ) -> Self {
        Self::of_noise(workers.estimate(&state.film, state.is_correlated), workers, state, audit)
    }

    /// Report of a picture whose `noise` is known.
    pub(super) fn of_noise(
        noise: Option<ErrorEstimate>,
        workers: &Workers,
        state: &RenderState,
        audit: impl FnOnce(ErrorEstimate) -> Option<Audited>,
    ) -> Self {
        let mut audited = noise.and_then(audit);
        // An audit without photons measures the blur as well, unless it is blind.
        let is_seen = audited.as_ref().is_some_and(|audited| !audited.has_photons && !audited.is_blind);
        let mut blurred = if is_seen { None } else { Blurred::of(workers, &state.film, noise) };
        if let Some(audited) = &mut audited
            && let Some(blurred) = blurred.take()
        {
            audited.total = audited.total.with_bias(blurred.blur);
        }
        Self { noise, audited, blurred }
    }

    /// Estimate with all parts.
    pub(super) fn error(&self) -> Option<ErrorEstimate> {
        let audited = self.audited.as_ref().map(|audited| audited.total);
        audited.or(self.blurred.map(|blurred| blurred.total)).or(self.noise)
    }
}
