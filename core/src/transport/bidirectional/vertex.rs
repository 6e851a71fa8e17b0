//! Vertices of light paths that camera paths are connected to, and scattering at a vertex seen from both
//! sides.

use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::geometry::{Hit, Ray};
use crate::photon::Photon;
use crate::scene::SurfacePoint;
use crate::transport::bidirectional::arrival::Arrival;
use crate::transport::bidirectional::mis::Sums;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::history::Rest;
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
    pub(super) fn rest(&self) -> Rest {
        Rest::from_bits(u32::from(self.arrival >> 8))
    }

    /// The way by which light comes to it; `None` where it is not merged.
    pub(super) fn arrival(&self) -> Option<Arrival> {
        match self.arrival & 0xff {
            0 => None,
            1 => Some(Arrival::FromCaster),
            _ => Some(Arrival::FromNear),
        }
    }

    /// The surface point, as the light path saw it.
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

/// f |cos| of the direction of the light, and the densities of both walks at a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::transport) struct Scattering {
    /// f(wo, wi) |cos wi|, for radiance that leaves by `wo`.
    pub value: Rgb,
    /// Density with which a camera walk that comes by `wo` goes on to `wi`.
    pub pdf_to_light: f32,
    /// Density with which a light walk that comes by `wi` goes on to `wo`.
    pub pdf_to_camera: f32,
}

/// Directions in the frame of the other side of a surface.
fn flipped(direction: Vec3) -> Vec3 {
    Vec3::new(direction.x, direction.y, -direction.z)
}

/// Scattering between local directions `wo` to the camera and `wi` to the light, for a `bsdf` on the side of
/// the camera.
pub(in crate::transport) fn scattering<F: Features>(
    context: &SceneContext<F>,
    (point, bsdf): (&SurfacePoint, &Bsdf),
    wo: Vec3,
    wi: Vec3,
) -> Scattering {
    let (value, pdf_to_light) = bsdf.evaluate::<F>(wo, wi);
    Scattering { value, pdf_to_light, pdf_to_camera: reverse_pdf(context, (point, bsdf), wo, wi) }
}

/// Scattering for a `bsdf` on the side of the light, as a light path has it.
pub(in crate::transport) fn scattering_from_light<F: Features>(
    context: &SceneContext<F>,
    (point, bsdf): (&SurfacePoint, &Bsdf),
    wo: Vec3,
    wi: Vec3,
) -> Scattering {
    if wo.z > 0.0 {
        return scattering(context, (point, bsdf), wo, wi);
    }
    if !bsdf.transmits() {
        return Scattering::default();
    }
    let behind = Bsdf::at::<F>(context.scene, point.material, point.uv, !point.front);
    let (value, pdf_to_light) = behind.evaluate::<F>(flipped(wo), flipped(wi));
    Scattering { value, pdf_to_light, pdf_to_camera: bsdf.evaluate::<F>(wi, wo).1 }
}

/// Density of the walk opposite to one that came by `from` and left by `to`, both local on the side of
/// `from`.
pub(in crate::transport) fn reverse_pdf<F: Features>(
    context: &SceneContext<F>,
    (point, bsdf): (&SurfacePoint, &Bsdf),
    from: Vec3,
    to: Vec3,
) -> f32 {
    if to.z > 0.0 {
        return bsdf.evaluate::<F>(to, from).1;
    }
    if !bsdf.transmits() {
        return 0.0;
    }
    let behind = Bsdf::at::<F>(context.scene, point.material, point.uv, !point.front);
    behind.evaluate::<F>(flipped(to), flipped(from)).1
}

/// Lowest cosine of a direction of arrival to the shading normal: below it the normal may have been turned to
/// the viewer, and depends on the walk.
const LOWEST_COS: f32 = 2e-3;

/// True if the shading normal of `point` may have been turned towards local direction `wo`. Light paths end
/// there, camera paths are not connected.
pub(in crate::transport) fn is_bent(point: &SurfacePoint, wo: Vec3) -> bool {
    wo.z < LOWEST_COS && point.frame.normal != point.geometric_normal
}

/// The normal that light sampling takes: none where light comes from both sides.
pub(in crate::transport) fn normal_for_lights(point: &SurfacePoint, bsdf: &Bsdf) -> Vec3 {
    if bsdf.transmits() { Vec3::ZERO } else { point.frame.normal }
}
