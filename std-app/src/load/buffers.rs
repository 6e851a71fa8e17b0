//! Buffers of a mesh in the coordinates of the core.

use halflight_core::scene::Triangle;

/// The buffers of [`halflight_core::scene::Mesh`].
#[derive(Debug, Default)]
pub(super) struct Geometry {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) texcoords: Vec<[f32; 2]>,
    pub(super) triangles: Vec<Triangle>,
    /// Object of each triangle.
    pub(super) objects: Vec<u32>,
    /// Number of vertices up to the end of each part.
    pub(super) ends: Vec<u32>,
}
