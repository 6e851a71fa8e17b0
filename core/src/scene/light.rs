//! Lights as the scene file says them: those without surface, and the environment.

use super::TextureId;
use crate::Rgb;
use glam::{Mat3, Vec3};

/// A light without surface: a ray cannot hit it, it has to be sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointLight {
    /// Shines alike in all directions.
    Point {
        /// Where.
        position: Vec3,
        /// Radiant intensity, W/sr.
        intensity: Rgb,
    },
    /// Shines into a cone, full inside `cos_inner` and falling to nothing at `cos_outer`, evenly in
    /// the angle.
    Spot {
        /// Where.
        position: Vec3,
        /// Unit axis of the cone.
        direction: Vec3,
        /// Radiant intensity on the axis, W/sr.
        intensity: Rgb,
        /// Cosine of the angle up to which intensity is full.
        cos_inner: f32,
        /// Cosine of the angle from which it is zero.
        cos_outer: f32,
    },
    /// Parallel light from infinitely far.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces it, W/m².
        irradiance: Rgb,
    },
}

/// Light from infinitely far, from all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// Factor on the map, or the radiance where there is none.
    pub radiance: Rgb,
    /// Latitude-longitude map: row 0 is up (+Y of the map), the azimuth `phi = 2 pi (column + 0.5) / width`
    /// belongs to the direction `(sin theta cos phi, cos theta, sin theta sin phi)` of the map.
    pub map: Option<TextureId>,
    /// From world directions to the map's.
    pub to_map: Mat3,
}
