//! Axis-aligned bounding box. An empty box has its minimum above its maximum.

use glam::Vec3;

/// Axis-aligned bounding box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Bounds {
    /// Empty box.
    pub const EMPTY: Bounds = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::including)
    }

    /// Smallest box around the box and `point`.
    #[inline]
    pub fn including(self, point: Vec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// Smallest box around both boxes.
    #[inline]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Edge lengths; zero if the box is empty.
    #[inline]
    pub fn extent(&self) -> Vec3 {
        (self.max - self.min).max(Vec3::ZERO)
    }

    /// Half of the surface area.
    #[inline]
    pub fn half_area(&self) -> f32 {
        let e = self.extent();
        e.x * (e.y + e.z) + e.y * e.z
    }

    /// Centre.
    #[inline]
    pub fn center(&self) -> Vec3 {
        0.5 * self.min + 0.5 * self.max
    }

    /// Length of the diagonal; zero if the box is empty.
    pub fn diagonal(&self) -> f32 {
        self.extent().length()
    }

    /// True if the box is empty.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }
}
