//! Vertex merging (Georgiev et al. 2012) at one vertex of a path: the first rough one from the camera, if
//! light comes to it by mirrors, glass or narrow gloss; or, where the camera sees it by others of them, from
//! a rough surface so near that its connections would be fireflies.
//!
//! No connection finds such light, which light samples and paths by chance find badly, and splats find it on
//! the area of a pixel alone. The rest of what density estimation could find has better techniques: light
//! between rough surfaces is connected. The photons of a kernel do not pass for independent samples of a
//! path then, as they do where every vertex is merged (Grittmann et al. 2021).

use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::photon::{Fence, Kernel, PhotonMap, QueryDisc};
use crate::transport::bidirectional::camera_paths::{CameraPath, CameraPaths, Vertex};
use crate::transport::bidirectional::mis::weight_of_merge;
use crate::transport::bidirectional::vertex::{LightVertex, scattering};
use crate::transport::photon_mapping::density::{GRAZING, fence};
use crate::transport::photon_mapping::radius::RadiusSchedule;
use crate::transport::walk::dimension;
use core::f32::consts::PI;
use glam::Vec3;

/// Radii of merges for a sample of the picture.
#[derive(Clone, Copy, Debug)]
pub struct MergeRadii {
    /// Radii of kernels.
    pub radii: RadiusSchedule,
    /// Light paths of the sample.
    pub light_paths: f32,
}

impl MergeRadii {
    /// η: expected number of light paths in the disc at `position`, if each has one vertex per m² there; 0
    /// where nothing is merged.
    pub(super) fn count(&self, bsdf: &Bsdf, position: Vec3) -> f32 {
        if !bsdf.is_receiver() {
            return 0.0;
        }
        let radius = self.radii.radius(position);
        self.light_paths * PI * radius * radius
    }
}

/// The way by which light comes to a vertex where it is merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arrival {
    /// From a narrow vertex.
    Narrow,
    /// From a rough one that is near.
    Near,
}

impl Arrival {
    /// From a vertex that `is_narrow`, or at this squared distance, to one with a count of merges η: about
    /// there merges and connections are as good as each other. `None` where light is not merged.
    pub(super) fn of(is_narrow: bool, squared: f32, count: f32) -> Option<Self> {
        match is_narrow {
            true => Some(Arrival::Narrow),
            false => (squared < count).then_some(Arrival::Near),
        }
    }

    /// Whether light is merged that comes so to the vertex at the end of segment `segments` of a camera path.
    pub(super) fn is_merged(self, segments: u32) -> bool {
        self == Arrival::Narrow || segments > 1
    }
}

/// The photons of a sample of the picture.
#[derive(Clone, Copy)]
pub struct Merging<'a> {
    /// Photons whose tags are indices of `vertices`.
    pub photons: &'a PhotonMap<'a>,
    /// All light vertices.
    pub vertices: &'a [LightVertex],
    /// Kernels.
    pub radii: MergeRadii,
}

impl<F: Features> CameraPaths<'_, F> {
    /// Light of the photons around `vertex`.
    pub(super) fn merge(&self, path: &mut CameraPath, vertex: &Vertex) {
        let Some(Merging { photons, radii, .. }) = self.merging else { return };
        let Vertex { point, merge, ref sampler, .. } = *vertex;
        if merge == 0.0 || photons.is_empty() {
            return;
        }
        let disc = QueryDisc {
            place: point.position,
            normal: point.geometric_normal,
            radius: radii.radii.radius_after(path.travelled, point.position),
            kernel: Kernel::Epanechnikov,
        };
        // Most places have no photon near them, and need not look for walls.
        let mut density = self.density(path, vertex, (&disc, None));
        if density == [Rgb::ZERO; 2] {
            return;
        }
        let origin = point.position + point.error * point.geometric_normal;
        let turns = sampler.single(dimension::PROBES + path.segments);
        let fence = fence(self.context.bvh, self.context.level, (origin, true), &disc, turns);
        if !fence.is_open() {
            density = self.density(path, vertex, (&disc, Some(&fence)));
        }
        // Both paths have met the cut-out, which the light passes but once.
        let opacity = self.context.opacity_at(point);
        let [light, finer] = density.map(|light| Rgb::from(path.throughput) * light / opacity);
        path.add(light);
        path.add_blur((light - finer) * (4.0 / 3.0));
    }

    /// The light of the photons on a disc that leaves `vertex`, and of those on one of half the radius.
    fn density(
        &self,
        path: &CameraPath,
        vertex: &Vertex,
        (disc, fence): (&QueryDisc, Option<&Fence>),
    ) -> [Rgb; 2] {
        let mut sums = [Rgb::ZERO; 2];
        let Some(Merging { photons, vertices, .. }) = self.merging else { return sums };
        photons.tagged_within(self.context.level, disc, fence, |tag, weights| {
            let light =
                vertices.get(tag as usize).map_or(Rgb::ZERO, |light| self.merged(path, vertex, light));
            sums = [sums[0] + light * weights[0], sums[1] + light * weights[1]];
        });
        sums
    }

    /// The light of one photon that leaves `vertex`, weighted: times m².
    fn merged(&self, path: &CameraPath, vertex: &Vertex, light: &LightVertex) -> Rgb {
        let is_merged = light.arrival().is_some_and(|arrival| arrival.is_merged(path.segments));
        if !is_merged || path.segments + u32::from(light.segments) > self.settings.max_depth {
            return Rgb::ZERO;
        }
        let Vertex { point, bsdf, wo, ref sums, merge, .. } = *vertex;
        let to_light = Vec3::from(light.to_light);
        let wi = point.frame.to_local(to_light);
        if !point.sides_agree(wi, to_light) {
            return Rgb::ZERO;
        }
        let at = scattering(&self.context, (point, bsdf), wo, wi);
        let weight = weight_of_merge(merge, (sums, at.to_camera), (&light.sums(), at.to_light));
        // The cosine of the geometric normal is in the density of photons.
        Rgb::from(light.power) * at.value * (weight / to_light.dot(point.geometric_normal).abs().max(GRAZING))
    }
}
