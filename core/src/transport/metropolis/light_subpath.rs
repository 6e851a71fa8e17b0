//! Light subpaths of given random numbers, with as many light paths as pixels.

use crate::bsdf::{BsdfSample, Features};
use crate::geometry::{Hit, Ray};
use crate::sampling::Numbers;
use crate::transport::walk::context::Origin;
use crate::transport::walk::light::scattered;
use crate::transport::walk::subpath::{Subpath, Vertex, Walk};
use crate::transport::walk::sums::{Counts, Sums};
use crate::transport::walk::techniques::{LightEnd, Weighted};
use crate::transport::walk::vertex::Scatterer;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A light subpath between two of its vertices.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct LightSubpath {
    pub(super) subpath: Subpath,
    /// Sums of the techniques of path tracing alone.
    pub(super) path_sums: Sums,
    /// Light that it left.
    light: u32,
}

impl<F: Features> Walk<'_, F> {
    /// A light subpath by the dimensions of emission of `numbers`.
    pub(super) fn start_at_light(&self, numbers: &impl Numbers) -> Option<(LightSubpath, Ray)> {
        let emitted = self.emission.emit(self.context.scene, &self.context.lights, numbers)?;
        let subpath = Subpath {
            throughput: (emitted.power / self.counts.light_paths).to_array(),
            position: emitted.ray.origin,
            segments: 1,
            origin: Origin { triangle: emitted.triangle, crossings: 0 },
            ..Subpath::default()
        };
        Some((LightSubpath { subpath, path_sums: Sums::default(), light: emitted.light }, emitted.ray))
    }

    /// The vertex where a light subpath arrives, and the sums of path tracing there. `None` where its shading
    /// normal depends on the subpath.
    pub(super) fn light_vertex<'v>(
        &self,
        light: &LightSubpath,
        at: Scatterer<'v>,
        direction: Vec3,
    ) -> Option<(Vertex<'v>, Sums)> {
        let vertex = Vertex::new(at, direction);
        if vertex.is_bent {
            return None;
        }
        let LightSubpath { subpath: Subpath { segments, sums, .. }, path_sums, .. } = light;
        let position = Vec3::from(light.subpath.position);
        let [sums, path_sums] = match segments {
            1 => [self.sums_from_light((light.light, position), &vertex); 2],
            _ => [sums, path_sums].map(|sums| self.sums_from(sums, position, &vertex)),
        };
        Some((Vertex { sums, ..vertex }, path_sums))
    }

    /// A light subpath goes on from `vertex` by a `sample` of the BSDF. Its next ray.
    pub(super) fn scatter_light(
        &self,
        light: &mut LightSubpath,
        (vertex, path_sums): (&Vertex, &Sums),
        sample: &BsdfSample,
    ) -> Option<Ray> {
        let towards = vertex.at.towards(sample)?;
        let sums = [(&self.counts, &vertex.sums), (&Counts::PATH_TRACING, path_sums)];
        let [sums, path_sums] = self.sums_behind(vertex, (sample, towards), sums, None);
        let Vertex { at, back, wo, .. } = *vertex;
        let power = scattered(light.subpath.throughput.into(), at.point, (back, wo), (towards, sample));
        light.path_sums = path_sums;
        light.subpath.leave(vertex, (sample, towards), power, sums)
    }
    /// End of a light subpath at `vertex`.
    pub(super) fn light_end<'v>(&self, light: &LightSubpath, vertex: Vertex<'v>) -> LightEnd<'v> {
        LightEnd {
            vertex,
            power: light.subpath.throughput.into(),
            // The power of a light subpath is over the number of pixels, as if all of them were traced.
            factor: self.counts.light_paths,
            path_sums: light.path_sums,
        }
    }

    /// The connection of a camera subpath with a light subpath that has ended where its `ray` met `hit`.
    pub(super) fn connect(
        &self,
        (subpath, vertex): (&Subpath, &Vertex),
        light: &LightSubpath,
        (ray, hit): (&Ray, &Hit),
    ) -> Option<(Ray, Weighted)> {
        if vertex.is_bent {
            return None;
        }
        let point = self.context.surface_at(ray, hit)?;
        let bsdf = self.context.bsdf_at(&point);
        let other = Vertex::new(Scatterer { point: &point, bsdf: &bsdf }, ray.direction.into());
        let end = self.light_end(light, Vertex { sums: light.subpath.sums, ..other });
        let link = self.link(vertex, point.position)?;
        self.connection((subpath, vertex), &link, &end, |_| [0.0; 2])
    }
}
