//! Vertex merging (Georgiev et al. 2012) at one vertex of a path: the first rough one from the camera, if
//! light comes to it from a caster: a mirror, glass or narrow gloss; or, where the camera sees it by casters,
//! from a rough surface so near that its connections would be fireflies.
//!
//! No connection finds such light, which light samples and paths by chance find badly, and splats find it on
//! the area of a pixel alone. The rest of what density estimation could find has better techniques: light
//! between rough surfaces is connected. The photons of a kernel do not pass for independent samples of a
//! path then, as they do where every vertex is merged (Grittmann et al. 2021).

use crate::Rgb;
use crate::bsdf::Features;
use crate::photon::{Kernel, KernelBoundary, QueryDisc};
use crate::transport::bidirectional::camera_path::{CameraPath, CameraVertex};
use crate::transport::bidirectional::camera_paths::CameraPaths;
use crate::transport::bidirectional::merge_photons::Merging;
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::photon_mapping::density::{GRAZING, kernel_boundary};
use crate::transport::walk::dimension;
use crate::transport::walk::subpath::Vertex;
use crate::transport::walk::sums::weight_of_merge;
use crate::transport::walk::vertex::Scatterer;
use glam::Vec3;

impl<F: Features> CameraPaths<'_, F> {
    /// Light of the photons around `vertex`.
    #[inline]
    pub(super) fn merge(&self, path: &mut CameraPath, vertex: &CameraVertex) {
        let Some(Merging { photons, radii, .. }) = &self.merging else { return };
        let CameraVertex { vertex: Vertex { at: Scatterer { point, .. }, .. }, eta_vcm, ref sampler, .. } =
            *vertex;
        if eta_vcm == 0.0 || photons.is_empty() {
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
        let turns = sampler.single(dimension::PROBES + path.subpath.segments);
        let boundary =
            kernel_boundary(&self.walk.context.bvh, self.walk.context.level, (origin, true), &disc, turns);
        if !boundary.is_open() {
            density = self.density(path, vertex, (&disc, Some(&boundary)));
        }
        // Both paths have met the cut-out, which the light passes but once.
        let opacity = self.walk.context.opacity_at(point);
        let [light, finer] = density.map(|light| Rgb::from(path.subpath.throughput) * light / opacity);
        path.add(light);
        path.add_blur((light - finer) * (4.0 / 3.0));
    }

    /// The light of the photons on a disc that leaves `vertex`, and of those on one of half the radius.
    fn density(
        &self,
        path: &CameraPath,
        vertex: &CameraVertex,
        (disc, boundary): (&QueryDisc, Option<&KernelBoundary>),
    ) -> [Rgb; 2] {
        let mut sums = [Rgb::ZERO; 2];
        let Some(Merging { photons, vertices, .. }) = &self.merging else { return sums };
        photons.tagged_within(self.walk.context.level, disc, boundary, |tag, weights| {
            let light =
                vertices.get(tag as usize).map_or(Rgb::ZERO, |light| self.merged(path, vertex, light));
            sums = [sums[0] + light * weights[0], sums[1] + light * weights[1]];
        });
        sums
    }

    /// The light of one photon that leaves `vertex`, weighted: times m².
    fn merged(&self, path: &CameraPath, vertex: &CameraVertex, light: &LightVertex) -> Rgb {
        let segments = path.subpath.segments;
        let is_merged = light.arrival().is_some_and(|arrival| arrival.is_merged(segments));
        if !is_merged || segments + u32::from(light.segments) > self.settings.max_depth {
            return Rgb::ZERO;
        }
        let CameraVertex { vertex: Vertex { at: here, wo, ref sums, .. }, eta_vcm, .. } = *vertex;
        let point = here.point;
        let to_light = Vec3::from(light.to_light);
        let wi = point.frame.to_local(to_light);
        if !point.sides_agree(wi, to_light) {
            return Rgb::ZERO;
        }
        let at = here.scattering(&self.walk.context, wo, wi);
        let weight = weight_of_merge(eta_vcm, (sums, at.pdf_to_camera), (&light.sums, at.pdf_to_light));
        // The cosine of the geometric normal is in the density of photons.
        Rgb::from(light.power) * at.value * (weight / to_light.dot(point.geometric_normal).abs().max(GRAZING))
    }
}
