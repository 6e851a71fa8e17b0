//! State of an audit in the header of a film file.

use halflight_core::audit::{AuditState, AuditWork};
use halflight_core::film::Pixel;
use serde::{Deserialize, Serialize};

/// Audited pixels, their weights and samples, and the work of the audit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct AuditEntry {
    share: f64,
    places: Vec<[u32; 2]>,
    shares: Vec<f32>,
    /// Bits of the audited pixels.
    pixels: Vec<[u32; size_of::<Pixel>() / 4]>,
    taken: u32,
    rays: u64,
    seconds: f64,
    #[serde(default)]
    has_photons: bool,
    #[serde(default)]
    unseen: f64,
}

impl AuditEntry {
    pub(super) fn new(state: &AuditState) -> Self {
        let AuditWork { fraction, samples, rays, seconds, has_photons, unseen } = state.work;
        Self {
            share: fraction,
            places: state.pixels.to_vec(),
            shares: state.weights.to_vec(),
            pixels: bytemuck::cast_slice(state.truth).to_vec(),
            taken: samples,
            rays,
            seconds,
            has_photons,
            unseen,
        }
    }

    pub(super) fn state(&self) -> AuditState<'_> {
        let Self { share, taken, rays, seconds, has_photons, unseen, .. } = *self;
        let work = AuditWork { fraction: share, samples: taken, rays, seconds, has_photons, unseen };
        let truth = bytemuck::cast_slice(&self.pixels);
        AuditState { work, pixels: &self.places, weights: &self.shares, truth }
    }
}
