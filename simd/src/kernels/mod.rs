//! Batch kernels: ray traversal ([`boxes`], [`triangles`], [`push`]), shading
//! of sixteen vertices ([`shade`]), coefficients and derivatives of incident light ([`cells`], [`mesh`],
//! [`edge`], [`jumps`], [`outer`], [`dots`], [`eigen`]), and photon maps ([`points`], [`select`]).

pub mod boxes;
pub mod cells;
pub mod dots;
pub mod edge;
pub mod eigen;
pub mod jumps;
pub mod mesh;
pub mod outer;
pub mod points;
pub mod push;
pub mod select;
pub mod shade;
pub mod triangles;

/// Largest finite reciprocal of a direction, so that `0 * inf` never reaches a slab test.
pub const RECIPROCAL_MAX: f32 = f32::MAX;

/// Reciprocal of a component of a direction, clamped to finite values. The sign of a zero is kept.
#[inline(always)]
pub fn safe_reciprocal(d: f32) -> f32 {
    (1.0 / d).clamp(-RECIPROCAL_MAX, RECIPROCAL_MAX)
}
