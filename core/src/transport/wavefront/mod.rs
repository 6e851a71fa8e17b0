//! The wavefront: all paths of a tile advance together, one segment at a time, so that the tracer sees
//! batches of rays (pbrt-v4, chapter 15). It knows rays and the state of paths, and calls a [`Shade`] for
//! blocks of vertices.

pub(in crate::transport) mod driver;
pub(in crate::transport) mod state;

pub(in crate::transport) use driver::Shade;
pub(in crate::transport) use state::{PathState, Wavefront};

/// Paths that advance together where memory allows: enough to fill the tracer's batches, few enough to stay
/// in the second cache.
pub const WAVE: usize = 2048;

/// Vertices that are shaded together.
pub(in crate::transport) const BLOCK: usize = 16;
