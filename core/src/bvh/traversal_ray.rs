//! Ray prepared for traversal (`TravRay`, Embree).

use crate::geometry::Ray;
use glam::{Vec4, Vec4Swizzles};
use halflight_simd::Simd;
use halflight_simd::kernels::RECIPROCAL_MAX;
use halflight_simd::kernels::boxes::SlabRay8;
use halflight_simd::kernels::triangles::{Shear, ShearRay8};

/// Everything of a ray that a traversal step reads, in one cache line.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct TraversalRay {
    pub origin: [f32; 3],
    /// Largest `t` that is still searched.
    pub t_max: f32,
    reciprocal: [f32; 3],
    /// Signs of the direction: bit `i` of axis `i`.
    octant: u32,
    /// Origin along the axes of the shear.
    sheared: [f32; 3],
    /// [`Shear::axes`], a byte each.
    axes: u32,
    factors: [f32; 3],
    /// Index of the ray in its batch.
    pub index: u32,
}

impl TraversalRay {
    /// No ray.
    pub(super) const NONE: TraversalRay = TraversalRay {
        origin: [0.0; 3],
        t_max: -1.0,
        reciprocal: [0.0; 3],
        octant: 0,
        sheared: [0.0; 3],
        axes: 0,
        factors: [0.0; 3],
        index: u32::MAX,
    };

    /// Prepares a [`traceable`] ray; the result for others is meaningless. Without branches.
    #[inline(always)]
    pub(super) fn new(ray: &Ray, index: u32) -> Self {
        let [x, y, z] = ray.direction;
        let direction = Vec4::new(x, y, z, 1.0);
        let limit = Vec4::splat(RECIPROCAL_MAX);
        let reciprocal = (Vec4::ONE / direction).min(limit).max(-limit);
        let octant = direction.is_negative_bitmask() & 7;
        let size = direction.abs();
        let larger = size.xxyy().cmpgt(size.yzzz()).bitmask() & 7;
        let axes = AXES[(larger << 3 | octant) as usize & 63];
        let words: &[f32; 8] = bytemuck::cast_ref(ray);
        let [kx, ky, kz] = unpack(axes);
        let scale = 1.0 / words[4 + kz];
        Self {
            origin: ray.origin,
            t_max: ray.t_max,
            reciprocal: reciprocal.truncate().to_array(),
            octant,
            sheared: [words[kx], words[ky], words[kz]],
            axes,
            factors: [words[4 + kx] * scale, words[4 + ky] * scale, scale],
            index,
        }
    }

    /// Signs of the direction, below 8.
    #[inline(always)]
    pub(super) fn octant(&self) -> usize {
        self.octant as usize & 7
    }

    #[inline(always)]
    pub(super) fn shear(&self) -> Shear {
        Shear { axes: unpack(self.axes), factors: self.factors }
    }

    #[inline(always)]
    pub(super) fn slab8<S: Simd>(&self, simd: S) -> SlabRay8<S> {
        SlabRay8::towards(simd, self.origin, self.reciprocal, self.octant())
    }

    #[inline(always)]
    pub(super) fn shear8<S: Simd>(&self, simd: S) -> ShearRay8<S> {
        ShearRay8::along(simd, unpack(self.axes), self.sheared, self.factors)
    }
}

#[inline(always)]
fn unpack(axes: u32) -> [usize; 3] {
    [axes as usize & 3, (axes >> 8) as usize & 3, (axes >> 16) as usize & 3]
}

/// [`Shear::axes`], a byte each, by the signs of the direction (low three bits) and by three comparisons of
/// its components: x > y, x > z, y > z in magnitude.
static AXES: [u32; 64] = {
    let mut table = [0; 64];
    let mut i = 0;
    while i < 64 {
        let z = match (i >> 3 & 1, i >> 4 & 1, i >> 5) {
            (1, 1, _) => 0,
            (0, _, 1) => 1,
            _ => 2,
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let (x, y) = if i >> z & 1 == 1 { (y, x) } else { (x, y) };
        table[i] = (x | y << 8 | z << 16) as u32;
        i += 1;
    }
    table
};

/// True if the ray can be traced: finite, with a direction, and `t_max` not negative. Without branches.
#[inline(always)]
pub(super) fn traceable(ray: &Ray) -> bool {
    let magnitude = |x: f32| x.to_bits() & 0x7fff_ffff;
    let [ox, oy, oz] = ray.origin;
    let [dx, dy, dz] = ray.direction;
    let direction = magnitude(dx).max(magnitude(dy)).max(magnitude(dz));
    let largest = direction.max(magnitude(ox)).max(magnitude(oy)).max(magnitude(oz));
    (largest < f32::INFINITY.to_bits()) & (direction > 0) & (ray.t_max >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shear_is_that_of_the_reference() {
        let values = [-2.0, -1.0, -0.0, 0.0, 0.5, 1.0, 2.0];
        for x in values {
            for y in values {
                for z in values {
                    let direction = [x, y, z];
                    let ray = Ray { origin: [1.0, 2.0, 3.0], t_max: 1.0, direction, tag: u32::MAX };
                    if traceable(&ray) {
                        assert_eq!(
                            TraversalRay::new(&ray, 0).shear(),
                            Shear::new(direction),
                            "{direction:?}"
                        );
                    }
                }
            }
        }
    }
}
