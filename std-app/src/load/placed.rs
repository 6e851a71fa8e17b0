//! Triangles of a file with their placement in the scene.

use super::obj::Group;
use super::texcoords::Texcoords;
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::rc::Rc;

/// Larger coordinates count as not finite, because their squares are infinite.
const LARGEST: f64 = 1e150;

/// A mesh of the scene.
pub(super) struct PlacedMesh {
    /// Name for messages and lightmaps.
    pub(super) name: String,
    /// Index of its OBJ.
    pub(super) obj: usize,
    pub(super) placement: Placement,
    /// Index into the materials of the scene for each material of the OBJ, and last for faces without
    /// material.
    pub(super) materials: Rc<[u32]>,
}

/// Position and orientation of a mesh: `linear * p + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    pub(super) linear: DMat3,
    pub(super) offset: DVec3,
}

impl Placement {
    /// The coordinates of the file.
    pub(super) const IDENTITY: Self = Self { linear: DMat3::IDENTITY, offset: DVec3::ZERO };

    pub(super) fn point(&self, p: [f64; 3]) -> [f64; 3] {
        if *self == Self::IDENTITY {
            return p;
        }
        (self.linear * DVec3::from(p) + self.offset).into()
    }

    /// The placement of something that is placed by `inner` in a file that is placed by this.
    pub(super) fn of(&self, inner: &Self) -> Self {
        if *self == Self::IDENTITY {
            return *inner;
        }
        Self { linear: self.linear * inner.linear, offset: self.linear * inner.offset + self.offset }
    }

    /// Transform of normals that keeps their side: the inverse transpose, up to a positive factor.
    pub(super) fn normal_matrix(&self) -> DMat3 {
        let [x, y, z] = [self.linear.x_axis, self.linear.y_axis, self.linear.z_axis];
        DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * self.linear.determinant().signum()
    }
}

/// Triangles of one material with their placement.
pub(super) struct Placed<'a> {
    pub(super) group: &'a Group,
    pub(super) placement: Placement,
    /// Index into the materials of the scene.
    pub(super) material: u32,
    pub(super) texcoords: Texcoords,
    /// Index into the objects of the scene for each object of the OBJ, and last for faces without object.
    pub(super) objects: &'a [u32],
}

impl Placed<'_> {
    /// Object of each triangle of the group.
    pub(super) fn triangle_objects(&self) -> impl Iterator<Item = u32> {
        let of_mesh = self.objects.last().copied().unwrap_or_default();
        let mut runs = self.group.objects.iter().peekable();
        let mut object = of_mesh;
        (0..self.group.triangles.len()).map(move |triangle| {
            while let Some(run) = runs.next_if(|run| run.first <= triangle) {
                object = run.object.map_or(of_mesh, |object| self.objects[object]);
            }
            object
        })
    }
}

/// Bounding box of all finite vertices; infinite and inverted if there are none.
pub(super) fn bounds(parts: &[Placed]) -> (DVec3, DVec3) {
    const EMPTY: (DVec3, DVec3) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let of_part = |part: &Placed| {
        let placed = part.group.positions.iter().map(|&p| part.placement.point(p)).filter(is_usable);
        placed.map(DVec3::from).fold(EMPTY, |(min, max), p| (min.min(p), max.max(p)))
    };
    parts.par_iter().map(of_part).reduce(|| EMPTY, |a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// True if a position counts as finite.
pub(super) fn is_usable(p: &[f64; 3]) -> bool {
    p.iter().all(|x| x.abs() <= LARGEST)
}
