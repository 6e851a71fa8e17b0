//! Material inputs: constants, optionally multiplied by a texture.

use super::{Scene, TextureId};
use crate::Rgb;
use crate::features::Features;
use glam::{Vec2, Vec4};

/// Colour, optionally multiplied by a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorInput {
    /// The constant factor.
    pub value: Rgb,
    /// The texture's RGB, linear.
    pub texture: Option<TextureId>,
}

/// Number, optionally multiplied by a channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarInput {
    /// The constant factor.
    pub value: f32,
    /// The texture and its channel (0 = R … 3 = A).
    pub texture: Option<(TextureId, u8)>,
}

impl From<Rgb> for ColorInput {
    fn from(value: Rgb) -> Self {
        Self { value, texture: None }
    }
}

impl From<f32> for ScalarInput {
    fn from(value: f32) -> Self {
        Self { value, texture: None }
    }
}

impl ColorInput {
    /// The colour at texture coordinates `uv`.
    #[inline]
    pub fn at<F: Features>(&self, scene: &Scene, uv: Vec2) -> Rgb {
        match self.texture {
            Some(id) if F::TEXTURES => self.value * texel(scene, id, uv).truncate(),
            _ => self.value,
        }
    }
}

impl ScalarInput {
    /// The number at texture coordinates `uv`.
    #[inline]
    pub fn at<F: Features>(&self, scene: &Scene, uv: Vec2) -> f32 {
        match self.texture {
            Some((id, channel)) if F::TEXTURES => {
                let texel = texel(scene, id, uv).to_array();
                self.value * texel.get(channel as usize).copied().unwrap_or(1.0)
            }
            _ => self.value,
        }
    }
}

/// Linear RGBA of a texture; white if the scene has no such texture.
#[inline]
fn texel(scene: &Scene, id: TextureId, uv: Vec2) -> Vec4 {
    scene.textures.get(id.0 as usize).map_or(Vec4::ONE, |texture| texture.lookup(uv).into())
}
