//! Bounds of a group of lights (position, directions, power) and the importance of the group at a point
//! (Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", section
//! 4). The same code evaluates one group or eight, with equal bits.
//!
//! Departure: cosines are averaged over a group, whereas the paper takes their maximum
//! (docs/decisions/lights.md).

use crate::geometry::{Bounds, Cone};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use halflight_simd::{Lanes, Simd, dot};

/// Upper limit of importances, so that their sums stay finite at a point on a light.
const MAX_IMPORTANCE: f32 = 1e30;

/// Coefficient k of the approximation (µ + √(µ² + k σ²)) / 2 to the mean of max(cos, 0) for cosines of mean µ
/// and variance σ². Exact for all directions at once, and for a hemisphere seen from its side.
const CLAMPED: f32 = 0.75;

/// k σ² of the cosines to points of a ball that is seen under a half-angle of sine 1. Exact for a ball on the
/// horizon.
const SPREAD: f32 = 0.14;

/// Mean of max(cos, 0) over all directions, for lights that emit in all directions.
const OMNIDIRECTIONAL: f32 = 0.25;

/// Lower limit of a cosine, as a fraction of its largest possible value.
const MIN_COSINE: f32 = 0.1;

/// Groups that are evaluated at once.
pub(super) const GROUPS: usize = 8;

/// Bounding sphere, cone of normals, and power of some lights; or those of several groups, in lanes. Every
/// light is assumed to emit into the half-space around its normal.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LightBounds<L = f32> {
    center: [L; 3],
    radius: L,
    axis: [L; 3],
    sin_cone: L,
    cos_cone: L,
    /// Luminance times area, of both sides if both emit, or luminous intensity. Four times the intensity for
    /// a light that emits in all directions, because a ball shows a quarter of its area. In units of the
    /// strongest light.
    power: L,
}

/// Bounds of eight groups. A group without power is absent.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct LightBounds8 {
    center: [[f32; GROUPS]; 3],
    radius: [f32; GROUPS],
    axis: [[f32; GROUPS]; 3],
    sin_cone: [f32; GROUPS],
    cos_cone: [f32; GROUPS],
    power: [f32; GROUPS],
}

impl LightBounds {
    pub(super) fn new(bounds: &Bounds, cone: Cone, power: f32) -> Self {
        Self {
            center: bounds.center().to_array(),
            // A margin for the rounding of the corners.
            radius: 0.5 * bounds.diagonal() * (1.0 + 1e-5),
            axis: cone.axis,
            sin_cone: sine(cone.cos, 0.0, 1.0),
            cos_cone: cone.cos,
            power,
        }
    }

    /// Centre and radius of the sphere.
    pub(super) fn sphere(&self) -> (Vec3, f32) {
        (self.center.into(), self.radius)
    }

    /// Estimate of the irradiance at `point` on a surface with `normal` (zero: facing everywhere). Zero only
    /// if no light of the group can reach the front of the surface.
    #[inline]
    pub(super) fn importance(&self, point: Vec3, normal: Vec3) -> f32 {
        importance(self, point, normal)
    }
}

impl LightBounds8 {
    /// Stores `group` as group `i`, below [`GROUPS`].
    pub(super) fn set(&mut self, i: usize, group: &LightBounds) {
        let i = i % GROUPS;
        for k in 0..3 {
            self.center[k][i] = group.center[k];
            self.axis[k][i] = group.axis[k];
        }
        self.radius[i] = group.radius;
        self.sin_cone[i] = group.sin_cone;
        self.cos_cone[i] = group.cos_cone;
        self.power[i] = group.power;
    }

    /// [`LightBounds::sphere`] of group `i`, below [`GROUPS`]; `None` if the group is absent.
    pub(super) fn sphere(&self, i: usize) -> Option<(Vec3, f32)> {
        let i = i % GROUPS;
        (self.power[i] > 0.0).then(|| (self.center.map(|all| all[i]).into(), self.radius[i]))
    }

    /// [`LightBounds::importance`] of each group.
    #[inline(always)]
    pub(super) fn importance<S: Simd>(&self, simd: S, point: Vec3, normal: Vec3) -> [f32; GROUPS] {
        let groups = LightBounds {
            center: [simd.load8(&self.center[0]), simd.load8(&self.center[1]), simd.load8(&self.center[2])],
            radius: simd.load8(&self.radius),
            axis: [simd.load8(&self.axis[0]), simd.load8(&self.axis[1]), simd.load8(&self.axis[2])],
            sin_cone: simd.load8(&self.sin_cone),
            cos_cone: simd.load8(&self.cos_cone),
            power: simd.load8(&self.power),
        };
        importance(&groups, point, normal).to_array()
    }
}

/// See [`LightBounds::importance`].
#[inline(always)]
fn importance<L: Lanes>(group: &LightBounds<L>, point: Vec3, normal: Vec3) -> L {
    let any = group.radius;
    let (zero, one) = (any.all(0.0), any.all(1.0));
    let parts = [zero, any.all(0.5), any.all(MIN_COSINE)];
    let [cx, cy, cz] = group.center;
    let to_light = [cx - any.all(point.x), cy - any.all(point.y), cz - any.all(point.z)];
    let (square, distance2) = (group.radius * group.radius, dot(to_light, to_light));
    let inverse = one / distance2.sqrt();
    let direction = [to_light[0] * inverse, to_light[1] * inverse, to_light[2] * inverse];
    // θ_u: half-angle of the cone that the sphere fills.
    let sin_u = group.radius * inverse;
    let uncertainty = (sin_u, sine(sin_u, zero, one));
    let spread = any.all(SPREAD) * sin_u * sin_u;
    let cos = -dot(direction, group.axis);
    let sin = sine(cos, zero, one);
    // θ' = max(θ - θ_o - θ_u, 0), the least angle to a normal of the group.
    let angle = minus_clamped((sin, cos), (group.sin_cone, group.cos_cone), zero, one);
    let most = minus_clamped(angle, uncertainty, zero, one).1;
    // Normals that fill a cone of half-angle θ_o evenly have the mean m = (1 + cos θ_o) / 2 along its axis,
    // with variance (1 - m)² / 3; the rest of 1 is across.
    let mean = any.all(0.5) * (one + group.cos_cone);
    let along = (one - mean) * (one - mean) * any.all(1.0 / 3.0);
    let across = any.all(0.5) * (one - mean * mean - along);
    let variance = any.all(CLAMPED) * (along * cos * cos + across * sin * sin) + spread * sin * sin;
    let shone = facing(mean * cos, variance, most, parts);
    let shone = shone.select(any.all(-1.0).lt(group.cos_cone), any.all(OMNIDIRECTIONAL));
    let mut strength = group.power * inverse * inverse * shone;
    if normal != Vec3::ZERO {
        let cos = dot(direction, [any.all(normal.x), any.all(normal.y), any.all(normal.z)]);
        let most = minus_clamped((sine(cos, zero, one), cos), uncertainty, zero, one).1;
        strength = strength * facing(cos, spread, most, parts);
    }
    // Inside the sphere lights may lie in any direction.
    let within = any.all(OMNIDIRECTIONAL) * group.power / square.max(any.all(f32::MIN_POSITIVE));
    let strength = within.select(distance2.le(square), strength);
    // Comparison with NaN is false: a NaN point receives no light.
    strength.min(any.all(MAX_IMPORTANCE)).select(zero.lt(strength), zero)
}

/// Mean of the positive part of cosines of this mean and variance, whose largest is `most`. No closure: one
/// that is not inlined lacks the instructions of its kernel and calls a function for each operation.
#[inline(always)]
fn facing<L: Lanes>(mean: L, variance: L, most: L, [zero, half, least]: [L; 3]) -> L {
    let about = half * (mean + (mean * mean + variance).sqrt());
    about.max(least * most).select(zero.lt(most), zero)
}

/// Sine of a cosine, or cosine of a sine.
#[inline(always)]
fn sine<L: Lanes>(cos: L, zero: L, one: L) -> L {
    (one - cos * cos).max(zero).sqrt()
}

/// (sin, cos) of max(a - b, 0) for angles in 0 … π.
#[inline(always)]
fn minus_clamped<L: Lanes>((sin_a, cos_a): (L, L), (sin_b, cos_b): (L, L), zero: L, one: L) -> (L, L) {
    let is_less = cos_b.lt(cos_a);
    let difference = (sin_a * cos_b - cos_a * sin_b, cos_a * cos_b + sin_a * sin_b);
    (zero.select(is_less, difference.0), one.select(is_less, difference.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Level;
    use crate::sampling::Random;
    use halflight_simd::Kernel;
    use std::vec::Vec;

    struct Weigh<'a>(&'a LightBounds8, Vec3, Vec3);

    impl Kernel for Weigh<'_> {
        type Out = [f32; GROUPS];

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Out {
            self.0.importance(simd, self.1, self.2)
        }
    }

    /// Random groups, and groups that are points, contain the point, emit in all directions, or have powers
    /// that overflow.
    fn group(random: &Random, i: u32) -> LightBounds {
        let [x, y, z, size, u, v, cos, power] = [0, 1, 2, 3, 4, 5, 6, 7].map(|k| random.single(8 * i + k));
        let center = 4.0 * Vec3::new(x, y, z) - 2.0;
        let half = match i % 4 {
            0 => 0.0,
            1 => 4.0 * size,
            _ => 0.3 * size,
        };
        let axis = crate::sampling::warp::uniform_cone([u, v], 2.0);
        let cos = if i.is_multiple_of(5) { -1.0 } else { 2.0 * cos - 1.0 };
        let power = if i.is_multiple_of(7) { 3e38 } else { power };
        let bounds = Bounds { min: center - half, max: center + half };
        LightBounds::new(&bounds, Cone { axis: axis.to_array(), cos }, power)
    }

    #[test]
    fn eight_groups_are_weighed_as_each_of_them() {
        let random = Random::new(1, 2);
        for case in 0..2000u32 {
            let all: Vec<LightBounds> = (0..GROUPS as u32).map(|i| group(&random, 8 * case + i)).collect();
            let mut groups = LightBounds8::zeroed();
            // The last group is absent in every other case.
            let count = GROUPS - (case as usize & 1);
            all.iter().take(count).enumerate().for_each(|(i, group)| groups.set(i, group));
            let [x, y, z, u, v] = [0, 1, 2, 3, 4].map(|k| random.single(1_000_000 + 5 * case + k));
            let (point, normal) = match case % 6 {
                0 => (Vec3::NAN, Vec3::Z),
                1 => (Vec3::from(all[0].center), Vec3::Z),
                2 => (4.0 * Vec3::new(x, y, z) - 2.0, Vec3::ZERO),
                _ => (4.0 * Vec3::new(x, y, z) - 2.0, crate::sampling::warp::uniform_cone([u, v], 2.0)),
            };
            let mut wanted = [0.0; GROUPS];
            for (slot, group) in wanted.iter_mut().zip(&all).take(count) {
                *slot = group.importance(point, normal);
            }
            assert!(wanted.iter().all(|value| (0.0..=MAX_IMPORTANCE).contains(value)), "{wanted:?}");
            for level in Level::detect().and_below() {
                let found = level.dispatch(Weigh(&groups, point, normal));
                assert_eq!(found.map(f32::to_bits), wanted.map(f32::to_bits), "{case} {}", level.name());
            }
        }
    }
}
