//! The camera: pinhole or thin lens.

use glam::Vec3;

/// A perspective camera. `aperture` 0 is a pinhole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it stands.
    pub eye: Vec3,
    /// Unit vector to the right of the picture.
    pub right: Vec3,
    /// Unit vector to the top of the picture.
    pub up: Vec3,
    /// Unit vector into the picture.
    pub forward: Vec3,
    /// Tangent of half of the vertical field of view.
    pub tan_half_fov: f32,
    /// Radius of the lens; 0 for a pinhole.
    pub lens_radius: f32,
    /// Distance along `forward` of what is sharp; of no effect for a pinhole.
    pub focus_distance: f32,
}
