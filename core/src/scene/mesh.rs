//! Indexed triangle mesh. Positions, normals and texture coordinates share one index per vertex.

use super::overlap::Overlap;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// Triangle with counter-clockwise vertices seen from the front, and its material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Triangle {
    /// Indices into the vertex arrays of [`Mesh`].
    pub vertices: [u32; 3],
    /// Index into the materials of the scene.
    pub material: u32,
}

/// Borrowed triangle mesh. Its indices are the responsibility of the caller; [`Mesh::validate`] checks them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mesh<'a> {
    /// Vertex positions.
    pub positions: &'a [[f32; 3]],
    /// Unit shading normals, one for each position, or empty. Faces with a zero normal are shaded flat.
    pub normals: &'a [[f32; 3]],
    /// Texture coordinates, one for each position, or empty. v points up.
    pub texcoords: &'a [[f32; 2]],
    /// Triangles.
    pub triangles: &'a [Triangle],
    /// Pairs of triangles that overlap in one plane, in both orders, ascending; or empty.
    pub overlaps: &'a [Overlap],
}

impl<'a> Mesh<'a> {
    /// Checks the indices. The error is the index of the first triangle with a vertex or material that does
    /// not exist, or 0 if `normals` or `texcoords` are neither empty nor as long as `positions`.
    pub fn validate(&self, materials: usize) -> Result<(), usize> {
        let vertices = self.positions.len();
        let fits = |length: usize| length == 0 || length == vertices;
        if !fits(self.normals.len()) || !fits(self.texcoords.len()) {
            return Err(0);
        }
        let broken = |t: &Triangle| {
            t.vertices.iter().any(|&v| v as usize >= vertices) || t.material as usize >= materials
        };
        self.triangles.iter().position(broken).map_or(Ok(()), Err)
    }

    /// Corner positions of triangle `index`; zeros if the triangle or a vertex does not exist.
    #[inline]
    pub fn corners(&self, index: u32) -> [Vec3; 3] {
        self.vertices(index).map(|v| self.positions.get(v as usize).copied().unwrap_or_default().into())
    }

    /// Texture coordinates at the corners; zeros without any.
    #[inline]
    pub fn corner_texcoords(&self, index: u32) -> [Vec2; 3] {
        self.vertices(index).map(|v| self.texcoords.get(v as usize).copied().unwrap_or_default().into())
    }

    #[inline]
    fn vertices(&self, index: u32) -> [u32; 3] {
        self.triangles.get(index as usize).map_or([u32::MAX; 3], |t| t.vertices)
    }
}
