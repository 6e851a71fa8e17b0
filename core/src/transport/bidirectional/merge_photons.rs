//! The photons that camera paths are merged with, and the radii of merges.

use crate::bsdf::Bsdf;
use crate::photon::PhotonMap;
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::photon_mapping::radius::RadiusSchedule;
use core::f32::consts::PI;
use glam::Vec3;

/// Radii of merges for a sample of the picture.
#[derive(Clone, Copy, Debug)]
pub struct MergeRadii {
    /// Radii of kernels.
    pub radii: RadiusSchedule,
    /// Light paths of the sample.
    pub light_paths: f32,
    /// Factor of η where a pilot asks for its weight; else 1.
    pub emphasis: f32,
}

impl MergeRadii {
    /// η: expected number of light paths in the disc at `position`, if each has one vertex per m² there; 0
    /// where nothing is merged.
    pub(super) fn eta_vcm(&self, bsdf: &Bsdf, position: Vec3) -> f32 {
        if !bsdf.is_receiver() {
            return 0.0;
        }
        let radius = self.radii.radius(position);
        self.emphasis * self.light_paths * PI * radius * radius
    }

    /// The squared distance within which a rough vertex is near, where merges count η.
    pub(super) fn near(&self, eta_vcm: f32) -> f32 {
        eta_vcm / self.emphasis
    }
}

/// The photons of a sample of the picture.
#[derive(Clone, Copy)]
pub struct Merging<'a> {
    /// Photons whose tags are indices of `vertices`.
    pub photons: PhotonMap<'a>,
    /// All light vertices.
    pub vertices: &'a [LightVertex],
    /// Kernels.
    pub radii: MergeRadii,
}
