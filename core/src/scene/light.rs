//! Lights of the scene description: lights without surface, and the environment.

use super::TextureId;
use crate::Rgb;
use glam::{Mat3, Vec3};

/// Light without surface, which rays cannot hit and which has to be sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointLight {
    /// Emits equally in all directions.
    Point {
        /// Position.
        position: Vec3,
        /// Radiant intensity, W/sr.
        intensity: Rgb,
    },
    /// Emits into a cone: full intensity inside `cos_inner`, falling linearly in the angle to zero at
    /// `cos_outer`.
    Spot {
        /// Position.
        position: Vec3,
        /// Unit axis of the cone.
        direction: Vec3,
        /// Radiant intensity on the axis, W/sr.
        intensity: Rgb,
        /// Cosine of the angle up to which intensity is full.
        cos_inner: f32,
        /// Cosine of the angle from which intensity is zero.
        cos_outer: f32,
    },
    /// Parallel light from infinity.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces it, W/m².
        irradiance: Rgb,
    },
}

/// Light from infinity, from all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// Factor on the map, or the radiance without a map.
    pub radiance: Rgb,
    /// Latitude-longitude map: row 0 is up (+Y of the map); the azimuth `phi = 2 pi (column + 0.5) / width`
    /// belongs to the direction `(sin theta cos phi, cos theta, sin theta sin phi)` of the map.
    pub map: Option<TextureId>,
    /// Rotation from world directions to those of the map.
    pub to_map: Mat3,
    /// A disc in front of it, as the sun.
    pub disc: Option<DistantDisc>,
}

/// Disc of constant radiance at infinity, as the sun. Paths hit it, and it is sampled by solid angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistantDisc {
    /// Unit direction towards its centre.
    pub direction: Vec3,
    /// Distance of its edge from its centre on the unit sphere, above 0 and below 2.
    pub chord: f32,
    /// Radiance, in addition to that of the environment.
    pub radiance: Rgb,
}

impl DistantDisc {
    /// Disc of angular `radius` (radians, below a quarter turn) around unit `direction`, which gives a
    /// surface that faces it this `irradiance`, W/m².
    pub fn of_irradiance(direction: Vec3, radius: f32, irradiance: Rgb) -> Self {
        let (sin, half) = (libm::sinf(radius), libm::sinf(0.5 * radius));
        let radiance = irradiance / (core::f32::consts::PI * sin * sin);
        Self { direction, chord: 2.0 * half, radiance }
    }

    /// True if unit direction `d` lies in the disc.
    #[inline]
    pub fn contains(&self, d: Vec3) -> bool {
        d.distance_squared(self.direction) <= self.chord * self.chord
    }
}

impl Environment {
    /// The same `radiance` from all directions.
    pub const fn uniform(radiance: Rgb) -> Self {
        Self { radiance, map: None, to_map: Mat3::IDENTITY, disc: None }
    }
}
