//! Instances: meshes that are placed many times and take the memory of one (object instances, pbrt).

use crate::geometry::{Bounds, Ray};
use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Vec3};
use halflight_simd::kernels::shade::surface::ERROR_UNITS;

/// Mesh in its own space, as ranges (first and end) of the arrays of [`super::Instances`]. Its triangles and
/// overlaps count vertices and triangles from the start of its ranges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Prototype {
    /// Range of the vertices.
    pub(super) vertices: [u32; 2],
    /// Range of the triangles.
    pub(super) triangles: [u32; 2],
    /// Range of the overlaps.
    pub(super) overlaps: [u32; 2],
    /// Least and greatest coordinates.
    pub(super) ends: [[f32; 3]; 2],
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
    pub(super) fn normal(&self, local: [f32; 3]) -> [f32; 3] {
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
pub(super) fn part<T>(all: &[T], [first, end]: [u32; 2]) -> &[T] {
    all.get(first as usize..end as usize).unwrap_or(&[])
}
