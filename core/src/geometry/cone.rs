//! Cone of directions.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Directions around an axis.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Cone {
    /// Unit axis.
    pub(crate) axis: [f32; 3],
    /// Cosine of the half-angle; -1 contains all directions.
    pub(crate) cos: f32,
}

impl Cone {
    /// All directions.
    pub(crate) const ALL: Cone = Cone { axis: [0.0, 0.0, 1.0], cos: -1.0 };

    /// True if the cone contains all directions.
    pub(crate) fn is_all(&self) -> bool {
        self.cos <= -1.0
    }

    /// Cosine of the smallest cone around unit `axis` that contains this cone.
    pub(crate) fn cos_around(&self, axis: Vec3) -> f32 {
        let (cos_a, cos_b) = (axis.dot(self.axis.into()).min(1.0), self.cos);
        if cos_a + cos_b <= 0.0 { -1.0 } else { cos_a * cos_b - sine(cos_a) * sine(cos_b) }
    }
}

/// Sine of the angle with this cosine.
fn sine(cos: f32) -> f32 {
    libm::sqrtf((1.0 - cos * cos).max(0.0))
}
