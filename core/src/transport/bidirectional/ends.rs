//! Sums of both subpaths at their first vertex, by the densities of the light or the camera that they leave.

use crate::bsdf::{Bsdf, Features};
use crate::light::{EmissionSampler, LightType};
use crate::scene::SurfacePoint;
use crate::transport::bidirectional::mis::{Counts, Sums};
use crate::transport::bidirectional::vertex::normal_for_lights;
use crate::transport::walk::context::SceneContext;
use glam::Vec3;

/// A vertex that a subpath has arrived at.
#[derive(Clone, Copy)]
pub(in crate::transport) struct End<'v> {
    pub point: &'v SurfacePoint<'v>,
    pub bsdf: &'v Bsdf,
    /// Cosine of the direction of arrival to the geometric normal.
    pub cos: f32,
}

/// Sums where a light path from `origin` on `light` arrives by direction `-to_light`: both densities of the
/// light as they are from there.
pub(in crate::transport) fn sums_from_light<F: Features>(
    context: &SceneContext<F>,
    emission: &EmissionSampler,
    counts: &Counts,
    (light, origin): (u32, Vec3),
    end: End,
    to_light: Vec3,
) -> Sums {
    let (scene, lights, position) = (context.scene, &context.lights, end.point.position);
    let normal = normal_for_lights(end.point, end.bsdf);
    let kind = emission.light_type(lights, light);
    let (pdf_light, density) = match kind {
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
    let sums = Sums::at_light(counts, pdf_light, density, end.cos, kind != LightType::Delta);
    Sums { last: if end.bsdf.is_delta() { 0.0 } else { sums.last }, ..sums }
}

/// Sums where a camera path through point `lens` of the lens arrives, in a picture of `size` pixels.
pub(in crate::transport) fn sums_from_camera<F: Features>(
    context: &SceneContext<F>,
    counts: &Counts,
    [width, height]: [u32; 2],
    lens: [f32; 2],
    end: End,
) -> Sums {
    let seen = context.scene.camera.project(width, height, end.point.position, lens);
    seen.map_or(Sums::default(), |seen| {
        let sums = Sums::at_camera(counts, width as f32 * height as f32 * seen.pdf);
        sums.arrive(seen.distance * seen.distance, end.cos, end.bsdf.is_delta())
    })
}
