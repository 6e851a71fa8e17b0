//! Error of a picture: noise, plus bias by an audit or by photon blur.

use super::audit::{Audit, Audited};
use super::workers::Workers;
use super::{ErrorEstimate, NoiseAndBlur};
use halflight_core::method::RenderState;

/// Error of a picture in its parts.
pub(super) struct ErrorReport {
    /// Noise alone.
    pub(super) noise: Option<ErrorEstimate>,
    /// Noise and bias, if there is an audit.
    pub(super) audited: Option<Audited>,
    /// Noise and blur, if there are photons and no audit.
    pub(super) noise_and_blur: Option<NoiseAndBlur>,
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
        let mut noise_and_blur = if is_seen { None } else { NoiseAndBlur::of(workers, &state.film, noise) };
        if let Some(audited) = &mut audited
            && let Some(noise_and_blur) = noise_and_blur.take()
        {
            audited.total = audited.total.with_bias(noise_and_blur.blur);
        }
        Self { noise, audited, noise_and_blur }
    }

    /// Estimate with all parts.
    pub(super) fn error(&self) -> Option<ErrorEstimate> {
        let audited = self.audited.as_ref().map(|audited| audited.total);
        audited.or(self.noise_and_blur.map(|noise_and_blur| noise_and_blur.total)).or(self.noise)
    }
}
