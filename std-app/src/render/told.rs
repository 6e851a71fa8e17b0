//! What a picture tells of its error at some time: its noise, and its bias by an audit or by what photons blur.

use super::audit::{Audit, Audited};
use super::workers::Workers;
use super::{Blurred, ErrorEstimate};
use halflight_core::method::RenderState;

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
    pub(super) fn of(workers: &Workers, state: &RenderState, audit: Option<&Audit>) -> Self {
        Self::by(workers, state, |noise| audit?.verdict(workers, &state.film, noise))
    }

    /// With what an audit says to the noise.
    pub(super) fn by(
        workers: &Workers,
        state: &RenderState,
        audit: impl FnOnce(ErrorEstimate) -> Option<Audited>,
    ) -> Self {
        Self::beside(workers.estimate(&state.film, state.is_correlated), workers, state, audit)
    }

    /// The same of a picture whose noise is known.
    pub(super) fn beside(
        noise: Option<ErrorEstimate>,
        workers: &Workers,
        state: &RenderState,
        audit: impl FnOnce(ErrorEstimate) -> Option<Audited>,
    ) -> Self {
        let mut audited = noise.and_then(audit);
        // An audit without photons sees what they blur, if it sees.
        let is_seen = audited.as_ref().is_some_and(|audited| !audited.has_photons && !audited.is_blind);
        let mut blurred = if is_seen { None } else { Blurred::of(workers, &state.film, noise) };
        if let Some(audited) = &mut audited
            && let Some(blurred) = blurred.take()
        {
            audited.total = audited.total.with_bias(blurred.blur);
        }
        Self { noise, audited, blurred }
    }

    /// All of it.
    pub(super) fn error(&self) -> Option<ErrorEstimate> {
        let audited = self.audited.as_ref().map(|audited| audited.total);
        audited.or(self.blurred.map(|blurred| blurred.total)).or(self.noise)
    }
}
