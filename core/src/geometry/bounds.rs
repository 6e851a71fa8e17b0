//! Axis-aligned boxes. The empty box has its minimum above its maximum.

use glam::Vec3;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Bounds {
    /// The box that holds nothing.
    pub const EMPTY: Bounds = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::including)
    }

    /// With `point` inside.
    #[inline]
    pub fn including(self, point: Vec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// The smallest box around both.
    #[inline]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Edge lengths; zero where the box is empty.
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

    /// The middle.
    #[inline]
    pub fn center(&self) -> Vec3 {
        0.5 * self.min + 0.5 * self.max
    }

    /// Length of the diagonal; zero where the box is empty.
    pub fn diagonal(&self) -> f32 {
        self.extent().length()
    }

    /// Whether the box holds nothing.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }
}
