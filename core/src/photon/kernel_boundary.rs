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

/// Cosine of half the angle between two probes. A straight wall that neither probe meets before length d is
/// at least this times d away between them.
const HALF_ANGLE_COSINE: f32 = 0.923_879_5;

/// The sectors in the coordinates (u, v) of the disc: u < 0, v < 0, |u| < |v|.
const SECTORS: [[bool; 3]; PROBES] = [
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
pub struct KernelBoundary {
    axes: [Vec3; 2],
    /// Visible radius of each sector, in radii of the disc.
    radii: [f32; PROBES],
}

impl KernelBoundary {
    /// Length of the probes, in radii of the disc, at which no wall passes between two of them.
    pub const PROBE_LENGTH: f32 = 1.0 / HALF_ANGLE_COSINE;

    /// Unit directions of the probes, in the tangent axes of [`KernelBoundary::frame`]. Probes must reach
    /// [`KernelBoundary::PROBE_LENGTH`] radii.
    pub const PROBE_DIRECTIONS: [Vec2; PROBES] = {
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

    /// Frame around `normal` for probes and sectors, its tangent axes rotated by `rotation` revolutions.
    pub fn frame(normal: Vec3, rotation: f32) -> Frame {
        let Frame { tangent, bitangent, .. } = Frame::from_normal(normal);
        let (sin, cos) = sin_cos_turns(rotation);
        Frame { tangent: cos * tangent + sin * bitangent, bitangent: cos * bitangent - sin * tangent, normal }
    }

    /// Boundary from the free lengths of the probes, in radii of the disc; infinite without a hit.
    pub fn new(frame: &Frame, lengths: [f32; PROBES]) -> Self {
        let mut radii = [1.0; PROBES];
        for (i, radius) in radii.iter_mut().enumerate() {
            let nearer = lengths[i].min(lengths[(i + 1) % PROBES]);
            *radius = (HALF_ANGLE_COSINE * nearer).clamp(0.0, 1.0);
        }
        Self { axes: [frame.tangent, frame.bitangent], radii }
    }

    /// Boundary of a disc that is visible as a whole.
    pub fn open(frame: &Frame) -> Self {
        Self::new(frame, [f32::INFINITY; PROBES])
    }

    /// True if the whole disc is visible.
    #[inline]
    pub fn is_open(&self) -> bool {
        self.radii.iter().all(|&radius| radius == 1.0)
    }

    /// Integral of the kernel over the visible part of the disc of `part` of the radius; 1 if all of it is
    /// visible.
    pub fn visible_fraction(&self, kernel: Kernel, part: f32) -> f32 {
        let parts = self.radii.iter().map(|&r| (r / part).min(1.0)).map(|r| match kernel {
            Kernel::Constant => r * r,
            Kernel::Cone => r * r * (3.0 - 2.0 * r),
            Kernel::Epanechnikov => r * r * (2.0 - r * r),
        });
        parts.sum::<f32>() / PROBES as f32
    }

    /// Mask of the visible photons. `offset` leads from each photon to the centre of the disc, `distance` is
    /// its square, and `squared_radius` is the square of the disc's radius.
    #[inline(always)]
    pub(super) fn contains<S: Simd>(
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
        for (sector, radius) in SECTORS.iter().zip(&self.radii) {
            if *radius < 1.0 {
                let here = if sector[0] { left } else { !left };
                let here = here & if sector[1] { below } else { !below };
                let here = here & if sector[2] { steep } else { !steep };
                hidden = hidden | (here & simd.splat16(radius * radius * squared_radius).lt(distance));
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
        for rotation in [0.0, 0.1, 0.77] {
            let Frame { tangent, bitangent, normal } = KernelBoundary::frame(Vec3::Z, rotation);
            assert!((tangent.cross(bitangent) - normal).length() < 1e-6);
        }
        for (i, part) in SECTORS.into_iter().enumerate() {
            let [way, next] = [i, (i + 1) % PROBES].map(|i| KernelBoundary::PROBE_DIRECTIONS[i]);
            assert!((way.dot(next) - core::f32::consts::FRAC_1_SQRT_2).abs() < 1e-6);
            let [u, v] = (way + next).to_array();
            assert_eq!(part, [u < 0.0, v < 0.0, u.abs() < v.abs()], "{i}");
        }
    }

    #[test]
    fn what_is_seen_of_a_disc_is_what_weights_integrate_to() {
        let open = KernelBoundary::open(&KernelBoundary::frame(Vec3::Y, 0.3));
        let half = KernelBoundary { radii: [0.5; PROBES], ..open };
        assert!(open.is_open() && !half.is_open());
        for (kernel, expected) in
            [(Kernel::Constant, 0.25), (Kernel::Cone, 0.5), (Kernel::Epanechnikov, 0.4375)]
        {
            assert_eq!(
                (open.visible_fraction(kernel, 1.0), half.visible_fraction(kernel, 1.0)),
                (1.0, expected)
            );
            assert_eq!((half.visible_fraction(kernel, 0.5), half.visible_fraction(kernel, 0.25)), (1.0, 1.0));
        }
    }
}
