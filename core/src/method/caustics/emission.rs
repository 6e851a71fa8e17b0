//! Emission of caustic photons that a prepass has learned, and the photon tracer that samples it.

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

/// Settings of the prepass of caustic photons.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CausticSettings {
    /// True if an irradiance cache supplies the light that rough surfaces reflect.
    pub beside_records: bool,
    /// Bytes that photon maps leave to other structures.
    pub reserved: usize,
    /// Rays that the time of the picture allows, if it is limited.
    pub most_rays: Option<f64>,
}

/// Emission and density estimation of caustic photons.
#[derive(Clone, Copy)]
pub struct CausticEmission<'a> {
    pub(super) sampler: EmissionSampler<'a>,
    /// Kernel radii of one pixel.
    pub(super) radii: RadiusSchedule,
    pub(super) benefit: Benefit,
}

/// Footprint of the two smallest photon maps.
pub fn least_footprint() -> Footprint {
    let map = PhotonMapStore::footprint(PHOTONS_PER_TASK);
    map.and(map)
}

/// Photon tracer of `paths` light paths, which `sampler` emits, for kernels of `radii`.
pub(super) fn photon_tracer<'a, F: Features>(
    context: &RenderContext<'a>,
    sampler: &'a EmissionSampler<'a>,
    paths: usize,
    radii: RadiusSchedule,
    beside_records: bool,
) -> CausticPhotonTracer<'a, F> {
    let RenderContext { scene, ref bvh, ref lights, settings, level, .. } = *context;
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
