//! The emission of caustic photons as a prepass has learned it, and the tracer of a map by it.

use super::benefit::Benefit;
use crate::bsdf::Features;
use crate::light::EmissionSampler;
use crate::memory::Footprint;
use crate::method::{PhotonMapStore, RenderContext};
use crate::transport::RadiusSchedule;
use crate::transport::caustics::tracer::{CausticPhotonTracer, PHOTONS_PER_TASK};
use crate::transport::photon_mapping::deposit::{PhotonFilter, PhotonTracerSettings};

/// Radius of the discs of the first sample, in pixels, with the usual photon budget.
pub(super) const FIRST_RADIUS: f64 = 1.0;

/// Conditions of a prepass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CausticSettings {
    /// Whether an irradiance cache has the light that rough surfaces reflect.
    pub beside_records: bool,
    /// Bytes that photons leave for others.
    pub reserved: usize,
}

/// How caustic photons are emitted and gathered.
#[derive(Clone, Copy)]
pub struct CausticEmission<'a> {
    pub(super) sampler: EmissionSampler<'a>,
    /// Radii of one pixel.
    pub(super) radii: RadiusSchedule,
    pub(super) benefit: Benefit,
}

/// Memory for the fewest photons.
pub fn least_footprint() -> Footprint {
    let map = PhotonMapStore::footprint(PHOTONS_PER_TASK);
    map.and(map)
}

/// A tracer of `paths` light paths by `sampler`, for discs of `radii`.
pub(super) fn photon_tracer<'a, F: Features>(
    context: &RenderContext<'a>,
    sampler: &'a EmissionSampler<'a>,
    paths: usize,
    radii: RadiusSchedule,
    beside_records: bool,
) -> CausticPhotonTracer<'a, F> {
    let RenderContext { scene, bvh, lights, settings, level } = *context;
    let traced = PhotonTracerSettings {
        keep: PhotonFilter::Caustic,
        seed: settings.seed,
        paths: paths as u32,
        max_depth: settings.max_depth,
    };
    let frame = (radii, [settings.width, settings.height]);
    CausticPhotonTracer::new((scene, bvh, lights), sampler, traced, frame, level)
        .beside_records(beside_records)
}
