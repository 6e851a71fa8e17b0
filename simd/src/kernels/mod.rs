//! Batch kernels of ray traversal, of derivatives of irradiance and of photon maps, each beside its plain scalar
//! reference.

pub mod boxes;
pub mod cells;
pub mod edge;
pub mod eigen;
pub mod jumps;
pub mod mesh;
pub mod points;
pub mod push;
pub mod select;
pub mod triangles;

/// The largest finite reciprocal of a direction: `0 * inf` never reaches a slab test.
pub const RECIPROCAL_MAX: f32 = f32::MAX;

/// Reciprocal of a direction component, clamped to finite values; zero counts as positive zero or
/// negative zero by its sign.
#[inline(always)]
pub fn safe_reciprocal(d: f32) -> f32 {
    (1.0 / d).clamp(-RECIPROCAL_MAX, RECIPROCAL_MAX)
}
