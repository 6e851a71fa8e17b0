//! Buffers of a mesh in the coordinates of the core.

use halflight_core::scene::Triangle;

/// The buffers of [`halflight_core::scene::Mesh`].
#[derive(Debug, Default)]
pub(super) struct Geometry {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) texcoords: Vec<[f32; 2]>,
    pub(super) second_texcoords: Vec<[f32; 2]>,
    pub(super) colors: Vec<[f32; 4]>,
    pub(super) triangles: Vec<Triangle>,
    /// Object of each triangle.
    pub(super) objects: Vec<u32>,
    /// Number of vertices up to the end of each part.
    pub(super) ends: Vec<u32>,
}

impl Geometry {
    /// Adds a copy of a vertex without its first texture coordinates, which differ.
    pub(super) fn push_copy(&mut self, vertex: usize) {
        self.positions.push(self.positions[vertex]);
        copy(&mut self.normals, vertex);
        copy(&mut self.second_texcoords, vertex);
        copy(&mut self.colors, vertex);
    }
}

fn copy<T: Copy>(values: &mut Vec<T>, vertex: usize) {
    values.extend(values.get(vertex).copied());
}
