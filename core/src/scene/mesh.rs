//! Indexed triangle mesh. Positions, normals and texture coordinates share one index per vertex.

use super::instance::{Instance, Prototype, part};
use super::overlap::Overlap;
use crate::geometry::{Bounds, MISS};
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
    /// Texture coordinates of a second set, as `texcoords`; nearly always empty.
    pub second_texcoords: &'a [[f32; 2]],
    /// Linear RGBA of the vertices, one for each position, or empty.
    pub colors: &'a [[f32; 4]],
    /// Triangles.
    pub triangles: &'a [Triangle],
    /// Pairs of triangles that overlap in one plane, in both orders, ascending; or empty.
    pub overlaps: &'a [Overlap],
    /// Meshes that are placed many times; usually none.
    pub instances: Instances<'a>,
}

/// Borrowed prototypes and their instances.
#[derive(Clone, Copy, Debug, Default)]
pub struct Instances<'a> {
    /// Vertex positions of all prototypes, in their own spaces.
    pub positions: &'a [[f32; 3]],
    /// Unit shading normals, one for each position, or empty.
    pub normals: &'a [[f32; 3]],
    /// Texture coordinates, one for each position, or empty.
    pub texcoords: &'a [[f32; 2]],
    /// Texture coordinates of a second set, as `texcoords`.
    pub second_texcoords: &'a [[f32; 2]],
    /// Linear RGBA of the vertices, one for each position, or empty.
    pub colors: &'a [[f32; 4]],
    /// Triangles of all prototypes. None emits.
    pub triangles: &'a [Triangle],
    /// Overlaps of all prototypes.
    pub overlaps: &'a [Overlap],
    /// Ranges of the prototypes.
    pub prototypes: &'a [Prototype],
    /// Instances, as [`Instances::number`] numbers them.
    pub placed: &'a [Instance],
}

impl<'a> Mesh<'a> {
    /// Checks the indices. The error is the index of the first triangle with a vertex or material that does
    /// not exist, or 0 if an array of vertices is neither empty nor as long as `positions`, or if the
    /// instances are broken.
    pub fn validate(&self, materials: usize) -> Result<(), usize> {
        let vertices = self.positions.len();
        let fits = |length: usize| length == 0 || length == vertices;
        let lengths =
            [self.normals.len(), self.texcoords.len(), self.second_texcoords.len(), self.colors.len()];
        if !lengths.into_iter().all(fits) {
            return Err(0);
        }
        let broken = |t: &Triangle| {
            t.vertices.iter().any(|&v| v as usize >= vertices) || t.material as usize >= materials
        };
        self.triangles.iter().position(broken).map_or(Ok(()), Err)?;
        let are_valid =
            self.instances.is_empty() || self.instances.are_valid(self.triangles.len(), materials);
        if are_valid { Ok(()) } else { Err(0) }
    }

    /// Number of triangles that rays meet: those in world space and those of all instances.
    pub fn triangle_count(&self) -> u64 {
        self.triangles.len() as u64 + self.instances.triangle_count()
    }

    /// Number of triangles in memory.
    pub fn unique_triangles(&self) -> usize {
        self.triangles.len() + if self.instances.is_empty() { 0 } else { self.instances.triangles.len() }
    }

    /// Bounds of all finite vertices in world space, and of all instances.
    pub fn bounds(&self) -> Bounds {
        let positions = self.positions.iter().map(|&p| Vec3::from(p));
        let own = Bounds::around(positions.filter(|p| p.is_finite()));
        let placed = self.instances.placed.iter().map(|instance| self.instances.bounds(instance));
        placed.fold(own, Bounds::union)
    }

    /// True if some surface has shading normals.
    #[inline]
    pub fn has_normals(&self) -> bool {
        !(self.normals.is_empty() && self.instances.normals.is_empty())
    }

    /// True if some triangles overlap in one plane.
    #[inline]
    pub fn has_overlaps(&self) -> bool {
        !(self.overlaps.is_empty() && self.instances.overlaps.is_empty())
    }

    /// Material of triangle `index`, of the mesh or of an instance.
    #[inline]
    pub fn material(&self, index: u32) -> Option<u32> {
        match self.triangles.get(index as usize) {
            Some(triangle) => Some(triangle.material),
            None => {
                let (_, mesh, local) = self.instance_of(index)?;
                Some(mesh.triangles.get(local as usize)?.material)
            }
        }
    }

    /// Corner positions of triangle `index` in world space; zeros if the triangle or a vertex does not exist.
    #[inline]
    pub fn corners(&self, index: u32) -> [Vec3; 3] {
        let at = |v: u32| self.positions.get(v as usize).copied().unwrap_or_default().into();
        match self.triangles.get(index as usize) {
            Some(triangle) => triangle.vertices.map(at),
            None => self.placed_triangle(index).map_or([Vec3::ZERO; 3], |t| t.positions.map(Vec3::from)),
        }
    }

    /// Texture coordinates at the corners; zeros without any.
    #[inline]
    pub fn corner_texcoords(&self, index: u32) -> [Vec2; 3] {
        let at = |v: u32| self.texcoords.get(v as usize).copied().unwrap_or_default().into();
        match self.triangles.get(index as usize) {
            Some(triangle) => triangle.vertices.map(at),
            None => self.placed_triangle(index).map_or([Vec2::ZERO; 3], |t| t.texcoords.map(Vec2::from)),
        }
    }
}

impl<'a> Instances<'a> {
    /// Nothing.
    pub const NONE: Self = Self {
        positions: &[],
        normals: &[],
        texcoords: &[],
        second_texcoords: &[],
        colors: &[],
        triangles: &[],
        overlaps: &[],
        prototypes: &[],
        placed: &[],
    };

    /// Mesh of a prototype in its own space; empty without such a prototype.
    #[inline]
    pub fn prototype(&self, number: u32) -> Mesh<'a> {
        let Some(ranges) = self.prototypes.get(number as usize) else { return Mesh::default() };
        Mesh {
            positions: part(self.positions, ranges.vertices),
            normals: part(self.normals, ranges.vertices),
            texcoords: part(self.texcoords, ranges.vertices),
            second_texcoords: part(self.second_texcoords, ranges.vertices),
            colors: part(self.colors, ranges.vertices),
            triangles: part(self.triangles, ranges.triangles),
            overlaps: part(self.overlaps, ranges.overlaps),
            instances: Instances::NONE,
        }
    }

    /// Gives the triangles of `placed` their indices, after `triangles` in world space. The error is the
    /// number of the first instance whose indices exceed 32 bits or whose prototype does not exist.
    pub fn number(triangles: usize, prototypes: &[Prototype], placed: &mut [Instance]) -> Result<(), usize> {
        let mut next = triangles as u64;
        for (number, instance) in placed.iter_mut().enumerate() {
            let prototype = prototypes.get(instance.prototype as usize).ok_or(number)?;
            instance.first = u32::try_from(next).map_err(|_| number)?;
            next += u64::from(prototype.triangles[1].saturating_sub(prototype.triangles[0]));
            if next >= u64::from(MISS) {
                return Err(number);
            }
        }
        Ok(())
    }

    /// True if prototypes and instances fit together, for `triangles` in world space and `materials`.
    pub(super) fn are_valid(&self, triangles: usize, materials: usize) -> bool {
        let mut next = triangles as u64;
        let is_next = self.placed.iter().all(|instance| {
            let first = core::mem::replace(
                &mut next,
                u64::from(instance.first) + self.prototype(instance.prototype).triangles.len() as u64,
            );
            u64::from(instance.first) == first && (instance.prototype as usize) < self.prototypes.len()
        });
        let mut numbers = 0..self.prototypes.len() as u32;
        is_next
            && next < u64::from(MISS)
            && numbers.all(|number| self.prototype(number).validate(materials).is_ok())
    }

    /// First triangle of a prototype among those of all prototypes.
    pub(crate) fn first_triangle_of(&self, prototype: u32) -> u32 {
        self.prototypes.get(prototype as usize).map_or(0, |prototype| prototype.triangles[0])
    }

    /// Bounds of an instance in world space: those of its prototype, placed.
    pub fn bounds(&self, instance: &Instance) -> Bounds {
        let ends = self.prototypes.get(instance.prototype as usize).map(|prototype| prototype.ends);
        let Some(ends) = ends.filter(|[low, high]| low[0] <= high[0]) else { return Bounds::EMPTY };
        let corner = |i: usize| instance.position([0, 1, 2].map(|axis| ends[i >> axis & 1][axis]));
        Bounds::around((0..8).map(corner))
    }

    /// True if nothing is placed.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// Number of the triangles of all instances.
    pub fn triangle_count(&self) -> u64 {
        self.placed.iter().map(|i| self.prototype(i.prototype).triangles.len() as u64).sum()
    }
}
