//! Sampling of all lights of a scene together, from surfaces and for light paths that start on them.

mod border;
mod bounds;
mod emission;
mod emitter;
mod environment;
mod etendue;
mod guide;
mod lights;
mod rectangle;
mod target;
mod tree;
mod triangle;
mod window;

pub use emission::{DIMENSIONS as EMISSION_DIMENSIONS, Emission, Emitted};
pub(crate) use etendue::Found;
pub use guide::Worth;
pub(crate) use guide::throws;
pub use lights::{LightPoint, LightSample, Lights};
pub(crate) use window::Row;
pub use window::{Aim, Bins, Grid, Window, Windows};

use crate::Rgb;
use crate::features::All;
use crate::scene::Scene;
use glam::Vec2;

/// The radiance that `triangle` emits at texture coordinates `uv`, to its front or its back.
#[inline]
pub fn emitted(scene: &Scene, triangle: u32, uv: Vec2, front: bool) -> Rgb {
    let material = scene.mesh.triangles.get(triangle as usize).map(|t| t.material as usize);
    match material.and_then(|m| scene.materials.get(m)) {
        Some(material) if front || material.two_sided => {
            // Maps may hold anything; light is never negative.
            material.emission.at::<All>(scene, uv).max(Rgb::ZERO)
        }
        _ => Rgb::ZERO,
    }
}

/// Relative luminance of linear sRGB (BT.709).
#[inline]
pub(crate) fn luminance(color: Rgb) -> f32 {
    color.dot(Rgb::new(0.2126, 0.7152, 0.0722))
}
