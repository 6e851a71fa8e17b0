//! Work that a time limit allows, in rays: it follows from the scene, as no clock is read.

use super::tuned::{DOUBLINGS_OF_WORK, FEW_TRIANGLES, RAYS_PER_SECOND};

/// Work in a scene with this number of `triangles` relative to one with few: its hierarchy is deeper, and its
/// surfaces have more detail.
pub fn work_of_detail(triangles: usize) -> f64 {
    1.0 + libm::log2(1.0 + triangles as f64 / FEW_TRIANGLES) / DOUBLINGS_OF_WORK
}

/// Rays per second and thread by which a time limit becomes work in a scene with this number of `triangles`.
pub fn rays_per_second(triangles: usize) -> f64 {
    RAYS_PER_SECOND / work_of_detail(triangles)
}
