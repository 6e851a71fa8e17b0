//! What is known of a group of lights: where they are, which way they shine, how strongly; and how much of
//! that can reach a point (Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive
//! Tree Splitting", section 4).

use crate::geometry::Bounds;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Importances are kept below this, so that their sums stay finite at a point on a light.
const LARGEST: f32 = 1e30;

/// A bounding sphere, a cone that holds the normals, and the power of some lights. Every light is taken to
/// shine into the half-space around its normal.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Group {
    center: [f32; 3],
    radius: f32,
    axis: [f32; 3],
    /// Cosine of the half-angle of the cone; -1 shines everywhere.
    cos_cone: f32,
    /// Luminance times area, or luminous intensity, in units of the strongest light.
    pub(super) power: f32,
}

/// The directions of a group: a cone.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Cone {
    pub(super) axis: [f32; 3],
    pub(super) cos: f32,
}

impl Cone {
    pub(super) const ALL: Cone = Cone { axis: [0.0, 0.0, 1.0], cos: -1.0 };

    /// The cosine of the cone around unit `axis` that holds this one.
    pub(super) fn cos_around(&self, axis: Vec3) -> f32 {
        let (cos_a, cos_b) = (axis.dot(self.axis.into()).min(1.0), self.cos);
        if cos_a + cos_b <= 0.0 { -1.0 } else { cos_a * cos_b - sine(cos_a) * sine(cos_b) }
    }
}

impl Group {
    pub(super) fn new(bounds: &Bounds, cone: Cone, power: f32) -> Self {
        Self {
            center: bounds.center().to_array(),
            // A little larger, against the rounding of the corners.
            radius: 0.5 * bounds.diagonal() * (1.0 + 1e-5),
            axis: cone.axis,
            cos_cone: cone.cos,
            power,
        }
    }

    /// The centre and the radius of the sphere.
    pub(super) fn sphere(&self) -> (Vec3, f32) {
        (self.center.into(), self.radius)
    }

    /// An estimate of the irradiance at `point` on a surface with `normal` (zero: facing everywhere). Zero
    /// only where no light of the group can reach the front of the surface.
    #[inline]
    pub(super) fn importance(&self, point: Vec3, normal: Vec3) -> f32 {
        let to_light = Vec3::from(self.center) - point;
        let radius2 = self.radius * self.radius;
        let distance2 = to_light.length_squared();
        // Within the sphere lights may lie in any direction.
        if distance2 <= radius2 {
            return (self.power / radius2.max(f32::MIN_POSITIVE)).min(LARGEST);
        }
        let direction = to_light * (1.0 / libm::sqrtf(distance2));
        // θ_u: half-angle of the cone in which the sphere is seen.
        let sin2_u = radius2 / distance2;
        let uncertainty = (libm::sqrtf(sin2_u), libm::sqrtf(1.0 - sin2_u));
        let mut strength = self.power / distance2;
        if self.cos_cone > -1.0 {
            // θ' = max(θ - θ_o - θ_u, 0), the least angle to a normal of the group.
            let cos = -direction.dot(self.axis.into());
            let cone = (sine(self.cos_cone), self.cos_cone);
            let rest = minus_clamped(minus_clamped((sine(cos), cos), cone), uncertainty);
            strength *= rest.1.max(0.0);
        }
        if normal != Vec3::ZERO {
            let cos = direction.dot(normal);
            strength *= minus_clamped((sine(cos), cos), uncertainty).1.max(0.0);
        }
        // Comparison with NaN is false: a point that is no number sees no light.
        if strength > 0.0 { strength.min(LARGEST) } else { 0.0 }
    }
}

#[inline]
fn sine(cos: f32) -> f32 {
    libm::sqrtf((1.0 - cos * cos).max(0.0))
}

/// (sin, cos) of max(a - b, 0) for angles of 0 … π.
#[inline]
fn minus_clamped((sin_a, cos_a): (f32, f32), (sin_b, cos_b): (f32, f32)) -> (f32, f32) {
    if cos_a > cos_b {
        return (0.0, 1.0);
    }
    (sin_a * cos_b - cos_a * sin_b, cos_a * cos_b + sin_a * sin_b)
}
