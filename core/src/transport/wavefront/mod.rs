//! Wavefront path tracing: all paths of a tile advance together, one segment at a time, so that rays are
//! traced in batches (pbrt-v4, chapter 15). The wavefront holds rays and path states, and calls a [`Shade`]
//! for blocks of vertices.

pub(in crate::transport) mod driver;
pub(in crate::transport) mod state;

pub(in crate::transport) use driver::Shade;
pub(in crate::transport) use state::{PathState, Wavefront};

/// Paths that advance together if memory allows: enough to fill batches of rays, few enough for the L2 cache.
pub const WAVE: usize = 2048;

/// Number of vertices that are shaded together.
pub(in crate::transport) const BLOCK: usize = 16;
