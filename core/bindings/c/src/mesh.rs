//! Triangles of a C program.

use crate::memory::{Strided, array};
use crate::status::HalflightStatus;
use halflight_core::memory::{Arena, Footprint};
use halflight_core::scene::{Mesh, Triangle};

/// Triangles. Strides are in bytes from one element to the next; 0: elements follow each other.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightMesh {
    /// Coordinates x, y, z of each vertex.
    pub positions: *const f32,
    /// Stride of `positions`.
    pub position_stride: usize,
    /// Unit normals of vertices, for smooth shading, or null.
    pub normals: *const f32,
    /// Stride of `normals`.
    pub normal_stride: usize,
    /// Texture coordinates u, v of each vertex, v up, or null.
    pub texcoords: *const f32,
    /// Stride of `texcoords`.
    pub texcoord_stride: usize,
    /// Number of vertices.
    pub vertices: usize,
    /// Three vertices of each triangle, counterclockwise seen from its front.
    pub triangle_vertices: *const u32,
    /// Stride of `triangle_vertices`.
    pub triangle_stride: usize,
    /// Material of each triangle, or null: the first.
    pub triangle_materials: *const u32,
    /// Number of triangles.
    pub triangles: usize,
}

impl HalflightMesh {
    /// The same without normals and texture coordinates, which rays do not need.
    pub(crate) fn positions_alone(&self) -> Self {
        Self { normals: core::ptr::null(), texcoords: core::ptr::null(), ..*self }
    }

    /// Memory of [`HalflightMesh::copied`].
    pub(crate) fn footprint(&self) -> Footprint {
        let normals = if self.normals.is_null() { 0 } else { self.vertices };
        let texcoords = if self.texcoords.is_null() { 0 } else { self.vertices };
        Footprint::default()
            .slice::<[f32; 3]>(self.vertices)
            .slice::<[f32; 3]>(normals)
            .slice::<[f32; 2]>(texcoords)
            .slice::<Triangle>(self.triangles)
    }

    /// The mesh in memory of `arena`.
    ///
    /// # Safety
    /// Its pointers are null or have as many elements as it says.
    pub(crate) unsafe fn copied<'m>(&self, arena: &mut Arena<'m>) -> Result<Mesh<'m>, HalflightStatus> {
        // SAFETY: by the caller.
        let positions = unsafe { copied(self.positions, self.vertices, self.position_stride, arena) }?;
        let count = |pointer: *const f32| if pointer.is_null() { 0 } else { self.vertices };
        // SAFETY: by the caller.
        let normals = unsafe { copied(self.normals, count(self.normals), self.normal_stride, arena) }?;
        // SAFETY: by the caller.
        let texcoords =
            unsafe { copied(self.texcoords, count(self.texcoords), self.texcoord_stride, arena) }?;
        let vertices =
            Strided::<[u32; 3]>::new(self.triangle_vertices, self.triangles, self.triangle_stride)?;
        let with_material = if self.triangle_materials.is_null() { 0 } else { self.triangles };
        // SAFETY: by the caller.
        let materials = unsafe { array(self.triangle_materials, with_material) }?;
        let triangles = arena.slice::<Triangle>(self.triangles)?;
        for (index, triangle) in triangles.iter_mut().enumerate() {
            // SAFETY: by the caller: `index` is below the number of triangles.
            let vertices = unsafe { vertices.get(index) };
            *triangle = Triangle { vertices, material: materials.get(index).copied().unwrap_or(0) };
        }
        Ok(Mesh { positions, normals, texcoords, triangles, ..Mesh::default() })
    }
}

/// A copy of an array with a stride.
///
/// # Safety
/// `first` is null or has `count` elements, of which any bits are a value.
unsafe fn copied<'m, U, const N: usize, V>(
    first: *const U,
    count: usize,
    stride: usize,
    arena: &mut Arena<'m>,
) -> Result<&'m [[V; N]], HalflightStatus>
where
    V: bytemuck::Pod,
    [V; N]: bytemuck::Pod,
{
    let elements = Strided::<[V; N]>::new(first, count, stride)?;
    let to = arena.slice(count)?;
    // SAFETY: by the caller.
    unsafe { elements.copy_to(to) };
    Ok(to)
}
