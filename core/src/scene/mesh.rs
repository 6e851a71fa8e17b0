//! Indexed triangles. Positions, normals and texture coordinates share one index per vertex.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// Three vertices, counter-clockwise seen from the front, and what they are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Triangle {
    /// Indices into the vertex arrays of [`Mesh`].
    pub vertices: [u32; 3],
    /// Index into the materials of the scene.
    pub material: u32,
}

/// Borrowed triangles. The loader (or the embedder) vouches for the indices: [`Mesh::validate`] checks them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mesh<'a> {
    /// Vertex positions.
    pub positions: &'a [[f32; 3]],
    /// Unit shading normals, one for each position, or empty. A zero normal means: shade the face flat.
    pub normals: &'a [[f32; 3]],
    /// Texture coordinates, one for each position, or empty. v points up.
    pub texcoords: &'a [[f32; 2]],
    /// The triangles.
    pub triangles: &'a [Triangle],
}

impl<'a> Mesh<'a> {
    /// Index of the first triangle that refers to a vertex or material that is not there; a mesh whose
    /// `normals` or `texcoords` are neither empty nor as long as `positions` fails at triangle 0.
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

    /// Corner positions of triangle `index`; zeros where the mesh has no such triangle or vertex.
    #[inline]
    pub fn corners(&self, index: u32) -> [Vec3; 3] {
        self.vertices(index).map(|v| self.positions.get(v as usize).copied().unwrap_or_default().into())
    }

    /// Shading normals at the corners; zeros where there are none.
    #[inline]
    pub fn corner_normals(&self, index: u32) -> [Vec3; 3] {
        self.vertices(index).map(|v| self.normals.get(v as usize).copied().unwrap_or_default().into())
    }

    /// Texture coordinates at the corners; zeros where there are none.
    #[inline]
    pub fn corner_texcoords(&self, index: u32) -> [Vec2; 3] {
        self.vertices(index).map(|v| self.texcoords.get(v as usize).copied().unwrap_or_default().into())
    }

    #[inline]
    fn vertices(&self, index: u32) -> [u32; 3] {
        self.triangles.get(index as usize).map_or([u32::MAX; 3], |t| t.vertices)
    }
}
