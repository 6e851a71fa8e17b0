//! Material inputs: constants, optionally multiplied by a texture.

use super::{Attributes, Scene, TextureId};
use crate::Rgb;
use crate::features::Features;
use glam::Vec4;

/// Colour, optionally multiplied by a texture and by the colours of vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorInput {
    /// The constant factor.
    pub value: Rgb,
    /// The texture's RGB, linear.
    pub texture: Option<TextureId>,
    /// True if the vertex colour is a factor too.
    pub vertex_color: bool,
}

/// Number, optionally multiplied by a channel of a texture and by the alpha of vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarInput {
    /// The constant factor.
    pub value: f32,
    /// The texture and its channel (0 = R … 3 = A).
    pub texture: Option<(TextureId, u8)>,
    /// True if the alpha of the vertex colour is a factor too.
    pub vertex_alpha: bool,
}

impl From<Rgb> for ColorInput {
    fn from(value: Rgb) -> Self {
        Self::constant(value)
    }
}

impl From<f32> for ScalarInput {
    fn from(value: f32) -> Self {
        Self::constant(value)
    }
}

impl ColorInput {
    /// The same everywhere.
    pub const fn constant(value: Rgb) -> Self {
        Self { value, texture: None, vertex_color: false }
    }

    /// True if it may differ from point to point.
    #[inline]
    pub fn varies(&self) -> bool {
        self.texture.is_some() || self.vertex_color
    }

    /// The colour at a point with these attributes.
    #[inline]
    pub fn at<F: Features>(&self, scene: &Scene, attributes: &Attributes) -> Rgb {
        match self.texture {
            Some(id) if F::TEXTURES => self.of_texel(texel(scene, id, attributes).truncate(), attributes),
            _ if F::TEXTURES => self.factor(attributes),
            _ => self.value,
        }
    }

    /// The colour of a texel.
    #[inline]
    pub(crate) fn of_texel(&self, texel: Rgb, attributes: &Attributes) -> Rgb {
        self.factor(attributes) * texel
    }

    #[inline]
    fn factor(&self, attributes: &Attributes) -> Rgb {
        if self.vertex_color { self.value * attributes.color } else { self.value }
    }
}

impl ScalarInput {
    /// The same everywhere.
    pub const fn constant(value: f32) -> Self {
        Self { value, texture: None, vertex_alpha: false }
    }

    /// True if it may differ from point to point.
    #[inline]
    pub fn varies(&self) -> bool {
        self.texture.is_some() || self.vertex_alpha
    }

    /// The number at a point with these attributes.
    #[inline]
    pub fn at<F: Features>(&self, scene: &Scene, attributes: &Attributes) -> f32 {
        let value = if F::TEXTURES && self.vertex_alpha { self.value * attributes.alpha } else { self.value };
        match self.texture {
            Some((id, channel)) if F::TEXTURES => {
                let texel = texel(scene, id, attributes).to_array();
                value * texel.get(channel as usize).copied().unwrap_or(1.0)
            }
            _ => value,
        }
    }
}

/// Linear RGBA of a texture; white if the scene has no such texture.
#[inline]
fn texel(scene: &Scene, id: TextureId, attributes: &Attributes) -> Vec4 {
    let texture = scene.textures.get(id.0 as usize);
    texture.map_or(Vec4::ONE, |texture| texture.lookup(texture.uv(attributes)).into())
}
