//! Scattering of light subpaths at bent shading normals (Veach 1997, section 5.3).
//!
//! Camera paths define the light: the shading normal is the one that the viewer sees, which is turned to face
//! a viewer below its horizon. The viewer of a light path is its next vertex, so that the path may leave to
//! any direction above the triangle: it is sampled by the cosine to the normal of the triangle, and on
//! surfaces that are not diffuse in half of the cases by the BSDF. The power changes by f cos θ of the light
//! as that viewer sees it, times the ratio of the cosines to the triangle.
use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::geometry::{Frame, Hit, Ray};
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::scene::SurfacePoint;
use crate::transport::walk::context::SceneContext;
use glam::Vec3;

/// True if the shading normal at `point` is not that of the triangle, and all lobes of `bsdf` have a width
/// and reflect.
pub(super) fn is_bent(point: &SurfacePoint, bsdf: &Bsdf) -> bool {
    point.frame.normal != point.geometric_normal
        && match bsdf {
            Bsdf::Diffuse(_) => true,
            Bsdf::Conductor(_) => !bsdf.is_delta(),
            Bsdf::Glossy(_) | Bsdf::Plastic(_) => bsdf.has_rough_coat(),
            Bsdf::Mirror(_) | Bsdf::Pane(_) | Bsdf::Dielectric(_) | Bsdf::RoughDielectric(_) => false,
        }
}

/// Samples the direction in which light that arrives along `ray` leaves `hit`, its surface `point` with this
/// `bsdf`; `u` in [0, 1), `u[2]` chooses the lobe. The weight of the sample is the factor of the power of the
/// light path.
pub(super) fn sample_bent<F: Features>(
    context: &SceneContext<F>,
    (ray, hit): (&Ray, &Hit),
    (point, bsdf): (&SurfacePoint, &Bsdf),
    [u, v, lobe]: [f32; 3],
) -> Option<BsdfSample> {
    let to_light = -Vec3::from(ray.direction);
    let from = point.frame.to_local(to_light);
    let flat = Frame::from_normal(point.geometric_normal);
    let of_bsdf = if matches!(bsdf, Bsdf::Diffuse(_)) { 0.0 } else { 0.5 };
    let towards = match lobe < of_bsdf {
        true => point.frame.to_world(bsdf.sample::<F>(from, [u, v, lobe / of_bsdf])?.direction),
        false => flat.to_world(cosine_hemisphere([u, v])),
    };
    let (cos, cos_of_light) = (towards.dot(point.geometric_normal), to_light.dot(point.geometric_normal));
    if !(cos > 0.0 && cos_of_light > 0.0) {
        return None;
    }
    let direction = point.frame.to_local(towards);
    let by_bsdf = if of_bsdf > 0.0 { bsdf.evaluate::<F>(from, direction).1 } else { 0.0 };
    let pdf = of_bsdf * by_bsdf + (1.0 - of_bsdf) * cosine_hemisphere_pdf(cos);
    let seen = context.surface_at(&Ray::new(point.position + towards, -towards), hit)?;
    let (value, _) = bsdf.evaluate::<F>(seen.frame.to_local(towards), seen.frame.to_local(to_light));
    let weight = value * (cos / (cos_of_light * pdf));
    (weight != Rgb::ZERO && weight.is_finite()).then(|| BsdfSample::reflection(direction, weight, pdf))
}
