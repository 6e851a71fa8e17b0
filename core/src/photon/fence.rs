//! Kernel boundary by eight probes: a density estimate without the part of its disc behind walls and edges
//! (boundary bias, Hey and Purgathofer 2002). Behind a wall thinner than the disc the same floor goes on and
//! holds photons of another room, which no test of planes and normals rejects. In a corner a part of the disc
//! is no surface, so that it holds too few photons for its area.
//!
//! Eight probes along the surface measure the distance to the next wall or to the edge of the surface itself.
//! A sector between two probes reaches as far as the shorter probe, less the most that a straight wall can
//! come nearer in between. Photons beyond are rejected, and the sum is divided by the integral of the kernel
//! over the rest.

use super::kernel::Kernel;
use crate::geometry::Frame;
use crate::sampling::sin_cos_turns;
use glam::{Vec2, Vec3};
use halflight_simd::{Lanes, Mask, Simd, dot};

/// Number of probes, and of sectors between them.
pub const PROBES: usize = 8;

/// Cosine of half the angle between two probes. A straight wall that neither probe meets before length d is at
/// least this times d away between them.
const BETWEEN: f32 = 0.923_879_5;

/// The sectors in the coordinates (u, v) of the disc: u < 0, v < 0, |u| < |v|.
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

/// Visible part of a disc, sector by sector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fence {
    axes: [Vec3; 2],
    /// Visible radius of each sector, in radii of the disc.
    reach: [f32; PROBES],
}

impl Fence {
    /// Length of the probes, in radii of the disc, at which no wall passes between two of them.
    pub const FARTHEST: f32 = 1.0 / BETWEEN;

    /// Unit directions of the probes, in the tangent axes of [`Fence::frame`]. Probes must reach
    /// [`Fence::FARTHEST`] radii.
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

    /// Frame around `normal` for probes and sectors, its tangent axes turned by `turns`.
    pub fn frame(normal: Vec3, turns: f32) -> Frame {
        let Frame { tangent, bitangent, .. } = Frame::from_normal(normal);
        let (sin, cos) = sin_cos_turns(turns);
        Frame { tangent: cos * tangent + sin * bitangent, bitangent: cos * bitangent - sin * tangent, normal }
    }

    /// Fence from the free lengths of the probes, in radii of the disc; infinite without a hit.
    pub fn new(frame: &Frame, shares: [f32; PROBES]) -> Self {
        let mut reach = [1.0; PROBES];
        for (i, reach) in reach.iter_mut().enumerate() {
            let nearer = shares[i].min(shares[(i + 1) % PROBES]);
            *reach = (BETWEEN * nearer).clamp(0.0, 1.0);
        }
        Self { axes: [frame.tangent, frame.bitangent], reach }
    }

    /// Fence of a disc that is visible as a whole.
    pub fn open(frame: &Frame) -> Self {
        Self::new(frame, [f32::INFINITY; PROBES])
    }

    /// True if the whole disc is visible.
    #[inline]
    pub fn is_open(&self) -> bool {
        self.reach.iter().all(|&reach| reach == 1.0)
    }

    /// Integral of the kernel over the visible part of the disc of `part` of the radius; 1 if all of it is
    /// visible.
    pub fn share(&self, kernel: Kernel, part: f32) -> f32 {
        let parts = self.reach.iter().map(|&r| (r / part).min(1.0)).map(|r| match kernel {
            Kernel::Constant => r * r,
            Kernel::Cone => r * r * (3.0 - 2.0 * r),
            Kernel::Epanechnikov => r * r * (2.0 - r * r),
        });
        parts.sum::<f32>() / PROBES as f32
    }

    /// Mask of the visible photons. `offset` leads from each photon to the centre of the disc, `distance` is
    /// its square, and `squared_radius` is the square of the disc's radius.
    #[inline(always)]
    pub(super) fn sees<S: Simd>(
        &self,
        simd: S,
        offset: [S::F16; 3],
        distance: S::F16,
        squared_radius: f32,
    ) -> <S::F16 as Lanes>::Mask {
        // The sign turns offsets to the centre into positions around it.
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
