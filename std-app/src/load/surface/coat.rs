//! Textures of the coats of glTF: the level of `KHR_materials_specular` and the clear coat, of which the core
//! has none of their own.

use super::Resolver;
use crate::load::mtl::MapKind;
use halflight_core::scene::{ScalarInput, TextureId};

impl Resolver<'_> {
    /// Texture of the reflectance of a coat: colours, times the alpha of the map of its level.
    pub(super) fn specular_texture(&mut self) -> Option<TextureId> {
        let mtl = self.mtl;
        let color = mtl.map(MapKind::Specular).filter(|map| self.textures.has(map));
        let Some(level) = mtl.map(MapKind::SpecularLevel).filter(|map| self.textures.has_alpha(map)) else {
            return self.textures.colour(color);
        };
        let combined = match color {
            None => self.textures.combined(&[(level, false)], &[], |texels| [texels[0][3]; 3]),
            Some(color) => {
                let product = |texels: &[[f32; 4]]| core::array::from_fn(|i| texels[0][i] * texels[1][3]);
                self.textures.combined(&[(color, true), (level, false)], &[], product)
            }
        };
        if combined.is_none() {
            self.leave_out("`specularTexture`");
        }
        combined.or_else(|| self.textures.colour(color))
    }

    /// Roughness of a clear coat and of the highlight below it as one: their mean by the weight of the coat.
    pub(super) fn coated_roughness(&mut self, [weight, roughness]: [f64; 2]) -> ScalarInput {
        let mtl = self.mtl;
        let kinds = [MapKind::Coat, MapKind::CoatRoughness, MapKind::Roughness];
        let [of_weight, of_coat, of_base] =
            kinds.map(|kind| mtl.map(kind).filter(|map| self.textures.has(map)));
        let weight = weight.clamp(0.0, 1.0);
        // All of the base may be covered.
        let of_base = of_base.filter(|_| weight < 1.0 || of_weight.is_some());
        let numbers = [weight, roughness, mtl.roughness.unwrap_or(1.0)];
        let maps = [of_weight, of_coat, of_base];
        let present: Vec<_> = maps.iter().flatten().map(|&map| (map, false)).collect();
        // The channels of the maps: red, green, green.
        let mean = |texels: &[[f32; 4]]| {
            let mut texels = texels.iter();
            let factors: [f32; 3] = core::array::from_fn(|i| {
                let texel = maps[i].and_then(|_| texels.next());
                texel.map_or(1.0, |texel| texel[usize::from(i > 0)])
            });
            let [weight, coat, base] = [0, 1, 2].map(|i| (numbers[i] as f32 * factors[i]).clamp(0.0, 1.0));
            [base + weight * (coat - base); 3]
        };
        let texture = self.textures.combined(&present, &numbers, mean);
        if texture.is_some() {
            return ScalarInput { texture: texture.map(|id| (id, 0)), ..1.0.into() };
        }
        if !present.is_empty() {
            self.leave_out("textures of its clear coat");
        }
        let [value, ..] = mean(&[[1.0; 4]; 3]);
        value.into()
    }

    fn leave_out(&mut self, what: &str) {
        let name = &self.mtl.name;
        let why = "other texture coordinates or samplers than the texture below, or memory is short";
        self.notes.add(1, format!("material `{name}`: {what} left out: {why}"));
    }
}
