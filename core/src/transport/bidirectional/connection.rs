//! Connections of camera paths with stored vertices of light paths (Veach 1997, section 10.2).

use crate::Rgb;
use crate::bsdf::Features;
use crate::geometry::Ray;
use crate::sampling::{ONE_MINUS_EPSILON, Sampler};
use crate::transport::bidirectional::camera_path::{CameraPath, CameraVertex, Queue};
use crate::transport::bidirectional::camera_paths::{CameraPaths, Connections};
use crate::transport::bidirectional::contribution::Class;
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::walk::dimension;
use crate::transport::walk::subpath::Vertex;
use crate::transport::walk::sums::{Arrival, Sums};
use crate::transport::walk::techniques::{LightEnd, Weighted};
use crate::transport::walk::vertex::Scatterer;
use glam::Vec3;

impl<F: Features> CameraPaths<'_, F> {
    /// Draws the light vertices that the vertex at the end of a path's segment is connected to, one of each
    /// of as many parts of their list.
    #[inline]
    pub(super) fn draw(&self, path: &CameraPath, sampler: &Sampler, drawn: &mut [u32]) {
        let Connections { vertices, count } = self.connections;
        let random = sampler.single(dimension::CONNECTION + path.subpath.segments);
        for (part, index) in drawn.iter_mut().enumerate() {
            let at = ((part as f32 + random) / count as f32).min(ONE_MINUS_EPSILON);
            *index = (at * vertices.len() as f32) as u32;
        }
    }

    /// Connections to the light vertices `drawn`.
    #[inline]
    pub(super) fn connect(
        &self,
        path: &CameraPath,
        vertex: &CameraVertex,
        drawn: &[LightVertex],
        tag: u32,
        queue: &mut Queue,
    ) {
        let each = self.connections.vertices.len() as f32 / self.connections.count as f32;
        for light in drawn {
            if let Some((ray, Weighted { radiance, .. })) = self.connection(path, vertex, light) {
                let rest = path.history.rest_of_connection(light.rest());
                queue.push((Class::Connections, rest), tag, ray, radiance * each);
            }
        }
    }

    /// The connection of a camera vertex with a light vertex: its shadow ray, and what arrives if nothing is
    /// in its way.
    #[inline]
    fn connection(
        &self,
        path: &CameraPath,
        &CameraVertex { ref vertex, is_first_rough, eta_vcm, .. }: &CameraVertex,
        light: &LightVertex,
    ) -> Option<(Ray, Weighted)> {
        let Self { walk, settings, merging, .. } = self;
        let segments = path.subpath.segments;
        if segments + u32::from(light.segments) + 1 > settings.max_depth {
            return None;
        }
        let link = walk.link(vertex, light.position.into())?;
        let other = light.point(&walk.context)?;
        let bsdf = walk.context.bsdf_at(&other);
        // The one merge of the path: at this vertex, or on the side of the light.
        let from_caster = bsdf.is_caustic_caster();
        let near = merging.as_ref().map_or(0.0, |merging| merging.radii.near(eta_vcm));
        let arrival = Arrival::of(from_caster, link.squared, near);
        let is_merged = arrival.is_some_and(|arrival| arrival.is_merged(segments));
        let behind = |reverse| match is_first_rough || path.has_rough() {
            true => 0.0,
            false => light.sums.pending_merge * if from_caster { reverse } else { 1.0 },
        };
        let back = Vec3::from(light.to_light);
        let (at, wo) = (Scatterer { point: &other, bsdf: &bsdf }, other.frame.to_local(back));
        let end = LightEnd {
            vertex: Vertex { at, back, wo, sums: light.sums, is_bent: false },
            power: Rgb::from(light.power),
            factor: 1.0,
            path_sums: Sums::default(),
        };
        let merges = |reverse| [if is_merged { eta_vcm } else { 0.0 }, behind(reverse)];
        walk.connection((&path.subpath, vertex), &link, &end, merges)
    }
}
