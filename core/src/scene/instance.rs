//! Instances: meshes that are placed many times and take the memory of one (object instances, pbrt).
//!
//! Triangles of instances have indices, but no memory of their own: those of the mesh in world space come
//! first, then those of the first instance in the order of its prototype, then those of the second. Corners
//! and normals are transformed when they are needed.

use super::mesh::{Mesh, Triangle};
use super::overlap::Overlap;
use crate::geometry::{Bounds, MISS, Ray};
use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Vec3};
use halflight_simd::kernels::shade::surface::ERROR_UNITS;

/// Mesh in its own space, as ranges (first and end) of the arrays of [`Instances`]. Its triangles and
/// overlaps count vertices and triangles from the start of its ranges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Prototype {
    /// Range of the vertices.
    vertices: [u32; 2],
    /// Range of the triangles.
    triangles: [u32; 2],
    /// Range of the overlaps.
    overlaps: [u32; 2],
    /// Least and greatest coordinates.
    ends: [[f32; 3]; 2],
}

/// Prototype placed by an affine transform: `linear * x + translation`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Instance {
    /// Columns of the inverse of `linear`.
    pub(crate) inverse: [[f32; 3]; 3],
    pub(crate) translation: [f32; 3],
    /// Index of its first triangle.
    pub(crate) first: u32,
    /// 1 if the transform mirrors, else 0.
    pub(crate) mirrored: u32,
    pub(crate) prototype: u32,
    /// Growth of rounding errors by the inverse and back: a norm of |linear| |inverse|.
    condition: f32,
    /// Columns.
    pub(crate) linear: [[f32; 3]; 3],
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
    /// Triangles of all prototypes. None emits.
    pub triangles: &'a [Triangle],
    /// Overlaps of all prototypes.
    pub overlaps: &'a [Overlap],
    /// Ranges of the prototypes.
    pub prototypes: &'a [Prototype],
    /// Instances, as [`Instances::number`] numbers them.
    pub placed: &'a [Instance],
}

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

impl Prototype {
    /// Prototype of these ranges; `positions` are those of all prototypes.
    pub fn new(
        positions: &[[f32; 3]],
        vertices: [u32; 2],
        triangles: [u32; 2],
        overlaps: [u32; 2],
    ) -> Prototype {
        let bounds = Bounds::around(part(positions, vertices).iter().map(|&p| p.into()));
        Self { vertices, triangles, overlaps, ends: [bounds.min.to_array(), bounds.max.to_array()] }
    }
}

impl Instance {
    /// Places prototype number `prototype` by columns and a translation. `None` if the transform is not
    /// finite or has no inverse in f32.
    pub fn new(prototype: u32, linear: [[f32; 3]; 3], translation: [f32; 3]) -> Option<Self> {
        let (inverse, determinant) = inverse_of(linear.map(|column| column.map(f64::from)));
        let all = linear.as_flattened().iter().chain(&translation).chain(inverse.as_flattened());
        let is_finite = all.clone().all(|x| x.is_finite());
        if !is_finite || determinant == 0.0 || inverse.iter().any(|column| column == &[0.0; 3]) {
            return None;
        }
        let size = |columns: [[f32; 3]; 3]| Mat3::from_cols_array_2d(&columns.map(|c| c.map(f32::abs)));
        let condition = (size(linear) * size(inverse) * Vec3::ONE).max_element();
        let mirrored = u32::from(determinant < 0.0);
        Some(Self { inverse, translation, first: 0, mirrored, prototype, condition, linear })
    }

    /// Number of its prototype.
    pub fn prototype(&self) -> u32 {
        self.prototype
    }

    /// Index of its first triangle.
    pub fn first_triangle(&self) -> u32 {
        self.first
    }

    /// Columns of the linear part, and the translation.
    pub fn transform(&self) -> ([[f32; 3]; 3], [f32; 3]) {
        (self.linear, self.translation)
    }

    /// True if the transform mirrors.
    pub fn is_mirrored(&self) -> bool {
        self.mirrored != 0
    }

    /// World position of a point of the prototype.
    #[inline]
    pub fn position(&self, local: [f32; 3]) -> Vec3 {
        placed(&self.linear, &self.translation, local)
    }

    /// `ray` in the space of the prototype, with the same `t` at each point.
    #[inline]
    pub fn local_ray(&self, ray: &Ray) -> Ray {
        local_ray(&self.inverse, &self.translation, ray)
    }

    /// Normal in world space: zero stays zero.
    #[inline]
    fn normal(&self, local: [f32; 3]) -> [f32; 3] {
        if local == [0.0; 3] {
            return local;
        }
        // By the transpose of the inverse.
        let [x, y, z] = self.inverse.map(|column| Vec3::from(column).dot(Vec3::from(local)));
        Vec3::new(x, y, z).normalize_or_zero().to_array()
    }

    /// Bound of the error of points of a triangle, relative to the tracer, beyond the bound for its corners
    /// in world space. A ray loses 4 roundings on its way into the space of the prototype, a quarter of
    /// [`ERROR_UNITS`]; corners may cancel the translation.
    #[inline]
    pub(crate) fn error(&self, corners: [[f32; 3]; 3]) -> f32 {
        let size = Mat3::from_cols_array_2d(&self.linear.map(|column| column.map(f32::abs)));
        let translation = Vec3::from(self.translation).abs();
        let (mut local, mut cancelled) = (0f32, 0f32);
        for corner in corners {
            let extent = size * Vec3::from(corner).abs();
            local = local.max(extent.max_element());
            cancelled = cancelled.max((extent + translation - self.position(corner).abs()).max_element());
        }
        ERROR_UNITS * (0.25 * self.condition * local + cancelled)
    }
}

/// Columns of the inverse of a matrix of three columns, and its determinant.
fn inverse_of([a, b, c]: [[f64; 3]; 3]) -> ([[f32; 3]; 3], f64) {
    let cross = |p: [f64; 3], q: [f64; 3]| {
        [0, 1, 2].map(|i| p[(i + 1) % 3] * q[(i + 2) % 3] - p[(i + 2) % 3] * q[(i + 1) % 3])
    };
    let rows = [cross(b, c), cross(c, a), cross(a, b)];
    let determinant = a[0] * rows[0][0] + a[1] * rows[0][1] + a[2] * rows[0][2];
    ([0, 1, 2].map(|column| rows.map(|row| (row[column] / determinant) as f32)), determinant)
}

/// `linear * local + translation`.
#[inline]
pub(crate) fn placed(linear: &[[f32; 3]; 3], translation: &[f32; 3], local: [f32; 3]) -> Vec3 {
    let [x, y, z] = linear.map(Vec3::from);
    local[0] * x + local[1] * y + local[2] * z + Vec3::from(*translation)
}

/// `ray` in the space of a prototype. The difference to the translation comes first: it is exact for nearby
/// origins, whatever their distance to the origin of the world.
#[inline]
pub(crate) fn local_ray(inverse: &[[f32; 3]; 3], translation: &[f32; 3], ray: &Ray) -> Ray {
    let [x, y, z] = inverse.map(Vec3::from);
    let o = Vec3::from(ray.origin) - Vec3::from(*translation);
    let d = ray.direction;
    let origin = (o.x * x + o.y * y + o.z * z).to_array();
    Ray { origin, direction: (d[0] * x + d[1] * y + d[2] * z).to_array(), ..*ray }
}

/// Part of a slice, empty if the range is out of it.
fn part<T>(all: &[T], [first, end]: [u32; 2]) -> &[T] {
    all.get(first as usize..end as usize).unwrap_or(&[])
}

impl<'a> Instances<'a> {
    /// Nothing.
    pub const NONE: Self = Self {
        positions: &[],
        normals: &[],
        texcoords: &[],
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

    /// Instance of triangle `index`; `None` before the first instance.
    #[inline]
    pub(crate) fn instance_of(&self, index: u32) -> Option<&'a Instance> {
        let number = self.placed.partition_point(|instance| instance.first <= index).checked_sub(1)?;
        self.placed.get(number)
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

impl<'a> Mesh<'a> {
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
        let at = |vectors: &[[f32; 3]], vertex: u32| vectors.get(vertex as usize).copied().unwrap_or_default();
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
