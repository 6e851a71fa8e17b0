//! Virtual point lights: vertices of light paths that light other surfaces (Keller 1997).

use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::geometry::{Hit, Ray};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::light::{LightPathState, Vertex};
use crate::transport::walk::vertex::{is_bent, is_bent_at};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::{FRAC_1_PI, PI};
use glam::Vec3;

/// A virtual point light: one cache line.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct VirtualLight {
    /// Position, m.
    position: [f32; 3],
    /// Triangle of the surface.
    triangle: u32,
    /// Unit normal of the triangle, on the side of the light path.
    normal: [f32; 3],
    /// Segments of the light path up to here, [`DIFFUSE`] and [`HIDDEN`].
    segments: u32,
    /// On a diffuse surface the radiance that it reflects times area, W/sr; on others the power that arrives,
    /// W.
    power: [f32; 3],
    /// On a diffuse surface the shading normal; on others the direction to the vertex before.
    direction: [f32; 3],
    /// On a diffuse surface the bound of the error of the position; on others the barycentric weights of the
    /// second and third corner of the triangle.
    place: [f32; 2],
}

/// The surface reflects the same radiance into all directions.
const DIFFUSE: u32 = 1 << 31;

/// Only virtual lights find its light: it has come from a light without extent by mirrors and smooth glass.
const HIDDEN: u32 = 1 << 30;

/// True if virtual lights are left on `bsdf`: it has a diffuse part, and no lobe in which a virtual light
/// would be a spike, or nothing at all.
#[inline]
pub(super) fn holds_virtual_lights(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Diffuse(_)) || bsdf.is_receiver() && bsdf.has_rough_coat() && !bsdf.has_narrow_coat()
}

/// True if virtual lights light `bsdf`.
#[inline]
pub(super) fn is_lit_by_virtual_lights(bsdf: &Bsdf) -> bool {
    !bsdf.is_delta() && !bsdf.is_caustic_caster()
}

/// The light that a virtual light sends to a point.
pub(super) struct Sent {
    /// Unit direction from the point.
    pub(super) direction: Vec3,
    /// cos / d², with the cosine to the normal of the triangle at the virtual light: density per area at a
    /// density of 1 per solid angle at the point.
    pub(super) solid_angle: f32,
    /// Radiance times area, W/sr.
    pub(super) radiance: Rgb,
    /// End of the shadow ray, off the surface.
    pub(super) target: Vec3,
}

impl VirtualLight {
    /// The virtual light at `vertex`, one of a set of which there are `sets`.
    pub(super) fn new(state: &LightPathState, vertex: &Vertex, sets: f32, is_hidden: bool) -> Self {
        let point = vertex.point;
        let power = sets * Rgb::from(state.power);
        let light = Self {
            position: point.position.to_array(),
            triangle: point.triangle,
            normal: point.geometric_normal.to_array(),
            segments: state.segments | if is_hidden { HIDDEN } else { 0 },
            power: power.to_array(),
            direction: vertex.to_light.to_array(),
            place: vertex.barycentric,
        };
        match vertex.bsdf {
            Bsdf::Diffuse(diffuse) if !is_bent_at(point, vertex.to_light) => {
                let cos = |normal: Vec3| vertex.to_light.dot(normal).abs();
                // Power is counted by the normal of the triangle, scattering by that of shading (Veach 1997,
                // 5.3).
                let bend = cos(point.frame.normal) / cos(point.geometric_normal);
                Self {
                    segments: light.segments | DIFFUSE,
                    power: (power * diffuse.reflectance * (bend * FRAC_1_PI)).to_array(),
                    direction: point.frame.normal.to_array(),
                    place: [point.error, 0.0],
                    ..light
                }
            }
            _ => light,
        }
    }

    /// Segments of the light path up to here.
    #[inline]
    pub(super) fn segments(&self) -> u32 {
        self.segments & !(DIFFUSE | HIDDEN)
    }

    /// True if only virtual lights find its light.
    #[inline]
    pub(super) fn is_hidden(&self) -> bool {
        self.segments & HIDDEN != 0
    }

    /// The light that it sends to `point`, if any.
    #[inline]
    pub(super) fn sent_to<F: Features>(&self, context: &SceneContext<F>, point: Vec3) -> Option<Sent> {
        let (position, normal) = (Vec3::from(self.position), Vec3::from(self.normal));
        let between = position - point;
        let squared = between.length_squared();
        let direction = between / libm::sqrtf(squared);
        let cos = -direction.dot(normal);
        if !(cos > 0.0 && squared > 0.0) {
            return None;
        }
        let (radiance, error) = if self.segments & DIFFUSE != 0 {
            let shading = Vec3::from(self.direction);
            if is_bent(shading, normal, -direction) {
                return None;
            }
            (Rgb::from(self.power), self.place[0])
        } else {
            self.reflected(context, direction)?
        };
        Some(Sent { direction, solid_angle: cos / squared, radiance, target: position + error * normal })
    }

    /// The same for any BSDF, seen in unit `direction`, and the bound of the error of the position.
    fn reflected<F: Features>(&self, context: &SceneContext<F>, direction: Vec3) -> Option<(Rgb, f32)> {
        // The surface as a camera path sees it.
        let ray = Ray::new(Vec3::from(self.position) - direction, direction);
        let [u, v] = self.place;
        let point = context.surface_at(&ray, &Hit { t: 1.0, u, v, triangle: self.triangle })?;
        let to_light = Vec3::from(self.direction);
        let wi = point.frame.to_local(to_light);
        if is_bent_at(&point, -direction) || !point.sides_agree(wi, to_light) {
            return None;
        }
        let (value, _) = context.bsdf_at(&point).evaluate::<F>(point.frame.to_local(-direction), wi);
        let cos = to_light.dot(point.geometric_normal).abs();
        Some((Rgb::from(self.power) * value / cos, point.error))
    }
}

/// Virtual lights in the disc by which their density is estimated.
const NEIGHBOURS: usize = 8;

/// Places where the density is estimated.
const PLACES: usize = 64;

/// An estimate of the area that has virtual lights: the mean of their reciprocal density. 0 where it is not
/// known.
pub fn lit_area(lights: &[VirtualLight]) -> f32 {
    let (mut sum, mut count) = (0f64, 0u32);
    for light in lights.iter().step_by((lights.len() / PLACES).max(1)) {
        let place = Vec3::from(light.position);
        // Squared distances of the nearest, itself among them, in ascending order.
        let mut nearest = [f32::INFINITY; NEIGHBOURS + 1];
        for other in lights {
            let mut squared = place.distance_squared(other.position.into());
            if squared < nearest[NEIGHBOURS] {
                for slot in &mut nearest {
                    if squared < *slot {
                        core::mem::swap(slot, &mut squared);
                    }
                }
            }
        }
        if nearest[NEIGHBOURS] < f32::INFINITY {
            sum += f64::from(PI * nearest[NEIGHBOURS]) * lights.len() as f64 / NEIGHBOURS as f64;
            count += 1;
        }
    }
    if count > 0 { (sum / f64::from(count)) as f32 } else { 0.0 }
}
