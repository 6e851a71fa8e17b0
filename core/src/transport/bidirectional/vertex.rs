//! Vertices of light paths that camera paths are connected to.

use crate::bsdf::Features;
use crate::geometry::{Hit, Ray};
use crate::photon::Photon;
use crate::scene::SurfacePoint;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::history::Rest;
use crate::transport::walk::sums::{Arrival, Sums};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A vertex of a light path: one cache line.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct LightVertex {
    /// Position, m.
    pub(super) position: [f32; 3],
    /// Triangle of the surface.
    pub(super) triangle: u32,
    /// W per light path of the pass, on arrival.
    pub(super) power: [f32; 3],
    /// Segments of the path up to here.
    pub(super) segments: u16,
    /// The way by which light comes to it, where it is merged, and the rest that the light belongs to.
    pub(super) arrival: u16,
    /// Unit direction to the vertex before.
    pub(super) to_light: [f32; 3],
    /// Barycentric weights of the second and third corner of the triangle.
    pub(super) barycentric: [f32; 2],
    /// Sums on arrival. The pending merge is that of paths whose camera vertices are all casters: η at a
    /// rough vertex; at a caster it lacks the reverse density.
    pub(super) sums: Sums,
}

impl LightVertex {
    /// With an `arrival` of light of a `rest`.
    pub(super) fn with_arrival(self, arrival: Option<Arrival>, rest: Rest) -> Self {
        let arrival = arrival.map_or(0, |arrival| 1 + arrival as u16);
        Self { arrival: arrival | (rest.bits() as u16) << 8, ..self }
    }

    /// Records that do not supply the light which comes to the vertex.
    #[inline]
    pub(super) fn rest(&self) -> Rest {
        Rest::from_bits(u32::from(self.arrival >> 8))
    }

    /// The way by which light comes to it; `None` where it is not merged.
    #[inline]
    pub(super) fn arrival(&self) -> Option<Arrival> {
        match self.arrival & 0xff {
            0 => None,
            1 => Some(Arrival::FromCaster),
            _ => Some(Arrival::FromNear),
        }
    }

    /// The surface point, as the light path saw it.
    #[inline]
    pub(super) fn point<'a, F: Features>(&self, context: &SceneContext<'a, F>) -> Option<SurfacePoint<'a>> {
        let [u, v] = self.barycentric;
        let direction = -Vec3::from(self.to_light);
        let ray = Ray::new(Vec3::from(self.position) - direction, direction);
        context.surface_at(&ray, &Hit { t: 1.0, u, v, triangle: self.triangle })
    }

    /// The photon that leads to this vertex, number `index` of its list; none where nothing is merged.
    pub fn photon<F: Features>(&self, context: &SceneContext<F>, index: u32) -> Photon {
        let point = self.arrival().and_then(|_| self.point(context));
        let direction = self.to_light.into();
        point.map_or(Photon::NONE, |point| {
            Photon::tagged(point.position, direction, point.geometric_normal, index)
        })
    }
}
