//! What of a disc is on this side of the walls around it. A wall that is thinner than the disc has photons of another
//! room behind it, on the same floor, which no test of planes and normals tells apart; and in a corner a part of the
//! disc is no surface at all, so that its photons are too few for its area.
//!
//! Eight probes along the surface say how far it is to the next wall, or to its own edge. What lies between two of them is seen as far as
//! the nearer, less what a straight wall comes nearer in between. Photons beyond are left out, and the weights of the
//! rest divided by what they integrate to over what is seen.

use super::kernel::Kernel;
use crate::geometry::Frame;
use crate::sampling::sin_cos_turns;
use glam::{Vec2, Vec3};
use halflight_simd::{Lanes, Mask, Simd, dot};

/// Probes, and parts of a disc between them.
pub const PROBES: usize = 8;

/// The cosine of half the angle between two probes: a wall that both meet at one is at least so far away between them.
const BETWEEN: f32 = 0.923_879_5;

/// For each part: whether the first coordinate of its places is below zero, the second, and whether the second is
/// larger in magnitude.
const PARTS: [[bool; 3]; PROBES] = [
    [false, false, false],
    [false, false, true],
    [true, false, true],
    [true, false, false],
    [true, true, false],
    [true, true, true],
    [false, true, true],
    [false, true, false],
];

/// How far a disc is seen, part by part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fence {
    axes: [Vec3; 2],
    /// Shares of the radius.
    reach: [f32; PROBES],
}

impl Fence {
    /// How far probes must go, in shares of the radius, so that no wall slips between two of them.
    pub const FARTHEST: f32 = 1.0 / BETWEEN;

    /// The directions of the probes, of unit length, along the axes of [`Fence::frame`]. They must go as far as
    /// [`Fence::FARTHEST`] of the radius.
    pub const WAYS: [Vec2; PROBES] = {
        const D: f32 = core::f32::consts::FRAC_1_SQRT_2;
        let way = Vec2::new;
        [
            way(1.0, 0.0),
            way(D, D),
            way(0.0, 1.0),
            way(-D, D),
            way(-1.0, 0.0),
            way(-D, -D),
            way(0.0, -1.0),
            way(D, -D),
        ]
    };

    /// The frame around `normal` whose other axes, turned by `turns`, probes and parts go by.
    pub fn frame(normal: Vec3, turns: f32) -> Frame {
        let Frame { tangent, bitangent, .. } = Frame::from_normal(normal);
        let (sin, cos) = sin_cos_turns(turns);
        Frame { tangent: cos * tangent + sin * bitangent, bitangent: cos * bitangent - sin * tangent, normal }
    }

    /// From the shares of the radius that probes get along, infinite where they meet nothing.
    pub fn new(frame: &Frame, shares: [f32; PROBES]) -> Self {
        let mut reach = [1.0; PROBES];
        for (i, reach) in reach.iter_mut().enumerate() {
            let nearer = shares[i].min(shares[(i + 1) % PROBES]);
            *reach = (BETWEEN * nearer).clamp(0.0, 1.0);
        }
        Self { axes: [frame.tangent, frame.bitangent], reach }
    }

    /// Of a disc that is seen all over.
    pub fn open(frame: &Frame) -> Self {
        Self::new(frame, [f32::INFINITY; PROBES])
    }

    /// Whether the whole disc is seen.
    #[inline]
    pub fn is_open(&self) -> bool {
        self.reach.iter().all(|&reach| reach == 1.0)
    }

    /// What the weights of a disc with that `part` of the radius integrate to over what is seen of it, of 1.
    pub fn share(&self, kernel: Kernel, part: f32) -> f32 {
        let parts = self.reach.iter().map(|&r| (r / part).min(1.0)).map(|r| match kernel {
            Kernel::Constant => r * r,
            Kernel::Cone => r * r * (3.0 - 2.0 * r),
            Kernel::Epanechnikov => r * r * (2.0 - r * r),
        });
        parts.sum::<f32>() / PROBES as f32
    }

    /// Which photons are seen: `offset` leads from each to the middle of the disc, `distance` is squared, and the
    /// limit of it `squared_radius`.
    #[inline(always)]
    pub(super) fn sees<S: Simd>(
        &self,
        simd: S,
        offset: [S::F16; 3],
        distance: S::F16,
        squared_radius: f32,
    ) -> <S::F16 as Lanes>::Mask {
        // Backwards, for offsets are.
        let [right, up] = self.axes;
        let (u, v) = (-dot(offset, splat(simd, right)), -dot(offset, splat(simd, up)));
        let zero = simd.splat16(0.0);
        let (left, below, steep) = (u.lt(zero), v.lt(zero), u.abs().lt(v.abs()));
        let mut hidden = simd.mask16(0);
        for (part, reach) in PARTS.iter().zip(&self.reach) {
            if *reach < 1.0 {
                let here = if part[0] { left } else { !left };
                let here = here & if part[1] { below } else { !below };
                let here = here & if part[2] { steep } else { !steep };
                hidden = hidden | (here & simd.splat16(reach * reach * squared_radius).lt(distance));
            }
        }
        debug_assert!(hidden.bits() <= 0xffff);
        !hidden
    }
}

/// The same vector in all lanes. No closures: see `facing` of `light/tree/importance.rs`.
#[inline(always)]
pub(super) fn splat<S: Simd>(simd: S, vector: Vec3) -> [S::F16; 3] {
    [simd.splat16(vector.x), simd.splat16(vector.y), simd.splat16(vector.z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_lie_between_their_probes() {
        for turns in [0.0, 0.1, 0.77] {
            let Frame { tangent, bitangent, normal } = Fence::frame(Vec3::Z, turns);
            assert!((tangent.cross(bitangent) - normal).length() < 1e-6);
        }
        for (i, part) in PARTS.into_iter().enumerate() {
            let [way, next] = [i, (i + 1) % PROBES].map(|i| Fence::WAYS[i]);
            assert!((way.dot(next) - core::f32::consts::FRAC_1_SQRT_2).abs() < 1e-6);
            let [u, v] = (way + next).to_array();
            assert_eq!(part, [u < 0.0, v < 0.0, u.abs() < v.abs()], "{i}");
        }
    }

    #[test]
    fn what_is_seen_of_a_disc_is_what_weights_integrate_to() {
        let open = Fence::open(&Fence::frame(Vec3::Y, 0.3));
        let half = Fence { reach: [0.5; PROBES], ..open };
        assert!(open.is_open() && !half.is_open());
        for (kernel, expected) in
            [(Kernel::Constant, 0.25), (Kernel::Cone, 0.5), (Kernel::Epanechnikov, 0.4375)]
        {
            assert_eq!((open.share(kernel, 1.0), half.share(kernel, 1.0)), (1.0, expected));
            assert_eq!((half.share(kernel, 0.5), half.share(kernel, 0.25)), (1.0, 1.0));
        }
    }
}
