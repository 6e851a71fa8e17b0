//! Scattering at a surface point, seen from both sides.

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::light::{EmissionSampler, LightType};
use crate::scene::SurfacePoint;
use crate::transport::walk::context::SceneContext;
use glam::Vec3;

/// f |cos| of the direction of the light, and the densities of both walks at a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Scattering {
    /// f(wo, wi) |cos wi|, for radiance that leaves by `wo`.
    pub value: Rgb,
    /// Density with which a camera walk that comes by `wo` goes on to `wi`.
    pub pdf_to_light: f32,
    /// Density with which a light walk that comes by `wi` goes on to `wo`.
    pub pdf_to_camera: f32,
}

/// Surface point with its BSDF, on the side that a subpath has come to.
#[derive(Clone, Copy)]
pub(crate) struct Scatterer<'v> {
    pub point: &'v SurfacePoint<'v>,
    pub bsdf: &'v Bsdf,
}

/// Direction in the frame of the other side of a surface.
#[inline]
fn flipped(direction: Vec3) -> Vec3 {
    Vec3::new(direction.x, direction.y, -direction.z)
}

impl Scatterer<'_> {
    /// Cosine of a unit `direction` to the geometric normal.
    #[inline]
    pub(crate) fn cos(&self, direction: Vec3) -> f32 {
        direction.dot(self.point.geometric_normal).abs()
    }

    /// Direction of a `sample` of the BSDF; `None` if it is on another side of the triangle.
    #[inline]
    pub(crate) fn towards(&self, sample: &BsdfSample) -> Option<Vec3> {
        let towards = self.point.frame.to_world(sample.direction);
        self.point.sides_agree(sample.direction, towards).then_some(towards)
    }

    /// Sample of the BSDF by `u` for a path that arrives by `direction`, and the direction in which it goes
    /// on.
    #[inline]
    pub(crate) fn sample<F: Features>(&self, direction: Vec3, u: [f32; 3]) -> Option<(BsdfSample, Vec3)> {
        let sample = self.bsdf.sample::<F>(self.point.frame.to_local(-direction), u)?;
        Some((sample, self.towards(&sample)?))
    }

    /// BSDF on the other side.
    #[inline]
    fn behind<F: Features>(&self, context: &SceneContext<F>) -> Bsdf {
        let point = self.point;
        Bsdf::at::<F>(context.scene, point.material, &point.attributes, !point.front)
    }

    /// Scattering between local directions `wo` to the camera and `wi` to the light, on the side of the
    /// camera.
    #[inline]
    pub(crate) fn scattering<F: Features>(
        &self,
        context: &SceneContext<F>,
        wo: Vec3,
        wi: Vec3,
    ) -> Scattering {
        let (value, pdf_to_light) = self.bsdf.evaluate::<F>(wo, wi);
        Scattering { value, pdf_to_light, pdf_to_camera: self.reverse_pdf(context, wo, wi) }
    }

    /// Scattering on the side of the light, as a light path has it.
    #[inline]
    pub(crate) fn scattering_from_light<F: Features>(
        &self,
        context: &SceneContext<F>,
        wo: Vec3,
        wi: Vec3,
    ) -> Scattering {
        if wo.z > 0.0 {
            return self.scattering(context, wo, wi);
        }
        if !self.bsdf.transmits() {
            return Scattering::default();
        }
        let (value, pdf_to_light) = self.behind(context).evaluate::<F>(flipped(wo), flipped(wi));
        Scattering { value, pdf_to_light, pdf_to_camera: self.bsdf.evaluate::<F>(wi, wo).1 }
    }

    /// Density of the walk opposite to one that came by `from` and left by `to`, both local on the side of
    /// `from`.
    #[inline]
    pub(crate) fn reverse_pdf<F: Features>(&self, context: &SceneContext<F>, from: Vec3, to: Vec3) -> f32 {
        if to.z > 0.0 {
            return self.bsdf.evaluate::<F>(to, from).1;
        }
        if !self.bsdf.transmits() {
            return 0.0;
        }
        self.behind(context).evaluate::<F>(flipped(to), flipped(from)).1
    }

    /// Kind of the light number `light`, seen in direction `to_light` with `origin` on it: the density of its
    /// light sample (a probability for lights without extent), and that of its emission per étendue.
    #[inline]
    pub(crate) fn densities_of_light<F: Features>(
        &self,
        context: &SceneContext<F>,
        emission: &EmissionSampler,
        (light, origin): (u32, Vec3),
        to_light: Vec3,
    ) -> (LightType, f32, f32) {
        let (scene, lights, kind) =
            (context.scene, &context.lights, emission.light_type(&context.lights, light));
        let (position, normal) = (self.point.position, self.normal_for_lights());
        let (pdf, density) = match kind {
            LightType::Area => {
                let triangle = lights.triangle_of(light).unwrap_or_default();
                let distance = position.distance(origin);
                let pdf = lights.pdf_hit(scene, position, normal, triangle, distance, to_light);
                (pdf, emission.density_of_emitter(scene, lights, light as usize, (origin, -to_light)))
            }
            LightType::Infinite => (
                lights.pdf_escape(scene, position, normal, to_light),
                emission.density_of_environment(scene, lights, to_light, position),
            ),
            LightType::Delta => (
                lights.probability(light, position, normal),
                emission.density_of_delta(scene, lights, light, position),
            ),
        };
        (kind, pdf, density)
    }

    /// Normal for light sampling: none where light comes from both sides.
    #[inline]
    pub(crate) fn normal_for_lights(&self) -> Vec3 {
        if self.bsdf.transmits() { Vec3::ZERO } else { self.point.frame.normal }
    }
}

/// Lowest cosine of a viewer to the shading normal.
const LOWEST_COS: f32 = 2e-3;

/// True if the `shading` normal at a triangle of normal `geometric` may have been turned towards a viewer in
/// direction `to_viewer`, on whom it depends. Light paths end there, and nothing is connected.
#[inline]
pub(crate) fn is_bent(shading: Vec3, geometric: Vec3, to_viewer: Vec3) -> bool {
    to_viewer.dot(shading) < LOWEST_COS && shading != geometric
}

/// [`is_bent`] at `point`.
#[inline]
pub(crate) fn is_bent_at(point: &SurfacePoint, to_viewer: Vec3) -> bool {
    is_bent(point.frame.normal, point.geometric_normal, to_viewer)
}
