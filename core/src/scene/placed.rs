//! Triangles of instances. They have indices, but no memory of their own: those of the mesh in world space
//! come first, then those of the first instance in the order of its prototype, then those of the second.
//! Corners and normals are transformed when they are needed.

use super::instance::Instance;
use super::mesh::{Instances, Mesh};

/// Triangle of an instance in world space. Its corners are counter-clockwise seen from the front.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedTriangle {
    pub(crate) positions: [[f32; 3]; 3],
    /// Zero without normals.
    pub(crate) normals: [[f32; 3]; 3],
    pub(crate) texcoords: [[f32; 2]; 3],
    pub(crate) material: u32,
    /// Error of its points beyond that of a triangle in world space, which the transforms of the ray and of
    /// the corners add.
    pub(crate) error: f32,
}

impl<'a> Instances<'a> {
    /// Number of the instance of triangle `index`; `None` before the first instance.
    #[inline]
    fn number_of(&self, index: u32) -> Option<usize> {
        self.placed.partition_point(|instance| instance.first <= index).checked_sub(1)
    }

    /// Instance of triangle `index`; `None` before the first instance.
    #[inline]
    pub(crate) fn instance_of(&self, index: u32) -> Option<&'a Instance> {
        self.placed.get(self.number_of(index)?)
    }
}

impl<'a> Mesh<'a> {
    /// Position of triangle `index` in a list of all triangles in world space and then all instances.
    pub(crate) fn index_among_objects(&self, index: u32) -> usize {
        self.instances.number_of(index).map_or(index as usize, |number| self.triangles.len() + number)
    }

    /// Instance of triangle `index`, its prototype, and its index there. `None` for triangles in world space.
    #[inline]
    pub(crate) fn instance_of(&self, index: u32) -> Option<(&'a Instance, Mesh<'a>, u32)> {
        let instance = self.instances.instance_of(index)?;
        let prototype = self.instances.prototype(instance.prototype);
        let local = index - instance.first;
        ((local as usize) < prototype.triangles.len()).then_some((instance, prototype, local))
    }

    /// Triangle `index` of an instance. `None` for triangles in world space.
    #[inline(never)]
    pub(crate) fn placed_triangle(&self, index: u32) -> Option<PlacedTriangle> {
        let (instance, mesh, local) = self.instance_of(index)?;
        let triangle = mesh.triangles.get(local as usize)?;
        let mut vertices = triangle.vertices;
        if instance.is_mirrored() {
            vertices.swap(1, 2);
        }
        let [a, b, c] = vertices.map(|vertex| mesh.positions.get(vertex as usize).copied());
        let corners = [a?, b?, c?];
        let at =
            |vectors: &[[f32; 3]], vertex: u32| vectors.get(vertex as usize).copied().unwrap_or_default();
        let texcoord = |vertex: u32| mesh.texcoords.get(vertex as usize).copied().unwrap_or_default();
        Some(PlacedTriangle {
            positions: corners.map(|corner| instance.position(corner).to_array()),
            normals: match mesh.normals.is_empty() {
                true => [[0.0; 3]; 3],
                false => vertices.map(|vertex| instance.normal(at(mesh.normals, vertex))),
            },
            texcoords: vertices.map(texcoord),
            material: triangle.material,
            error: instance.error(corners),
        })
    }
}
