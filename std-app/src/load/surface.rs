//! Meaning of MTL statements: from [`MtlMaterial`] to the core's [`Material`], by the conventions of
//! `docs/loading.md`. `docs/decisions/0002-plastic-from-mtl.md` explains the conventions for plastics.

mod inputs;

use super::illum::{self, DARK_BASE, is_glass, is_pbr};
use super::mtl::{MapKind, MtlMaterial};
use super::notes::Notes;
use super::texture_set::TextureSet;
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, Material, ScalarInput, Surface};

/// Relative difference of `Ks` and the Fresnel reflectance of `Ni` up to which a coat is a dielectric: files
/// have two or three digits.
const PLASTIC_TOLERANCE: f64 = 0.05;
/// Index of refraction of glass and PBR coats without `Ni`.
const DEFAULT_IOR: f64 = 1.5;

/// The material of the core; adds the views of its textures to `textures`.
pub(super) fn resolve(mtl: &MtlMaterial, textures: &mut TextureSet, notes: &mut Notes) -> Material {
    illum::note_ignored_statements(mtl, notes);
    let mut resolver = Resolver { mtl, textures, notes };
    let surface = resolver.surface();
    Material {
        surface,
        emission: resolver.emission(),
        two_sided: mtl.two_sided,
        opacity: resolver.opacity(),
        normal_map: resolver.normal_map(),
    }
}

struct Resolver<'a> {
    mtl: &'a MtlMaterial,
    textures: &'a mut TextureSet,
    notes: &'a mut Notes,
}

impl Resolver<'_> {
    /// `Pr`, `Pm`, their maps and a diffuse base override `illum`.
    fn surface(&mut self) -> Surface {
        if is_glass(self.mtl) {
            return self.glass();
        }
        let base = self.diffuse();
        let metallic = self.metallic();
        if metallic.texture.is_none() && metallic.value >= 1.0 {
            self.metal(base)
        } else if metallic == 0.0.into() && self.is_mirror(&base) {
            self.mirror(base)
        } else {
            self.coated(base, metallic)
        }
    }

    fn glass(&mut self) -> Surface {
        let roughness = match (self.mtl.roughness, self.mtl.map(MapKind::Roughness)) {
            (None, None) => 0.0.into(),
            _ => self.roughness(),
        };
        let tint = self.reflectance("Tf", self.mtl.tint.unwrap_or([1.0; 3]));
        Surface::Dielectric { ior: self.ior().unwrap_or(DEFAULT_IOR) as f32, tint, roughness }
    }

    /// A metal of colour `Kd`, or `Ks` if `Kd` is black or absent; by `illum 3` a perfect mirror if `Pr` is 0.
    fn metal(&mut self, base: ColorInput) -> Surface {
        let is_absent = self.mtl.diffuse.is_none() && !self.mtl.has_map(MapKind::Diffuse);
        let by_specular = self.has_specular() && (is_black(&base) || is_absent);
        let reflectance = if by_specular { self.specular() } else { base };
        let is_smooth = self.mtl.roughness == Some(0.0) && !self.mtl.has_map(MapKind::Roughness);
        match (self.mtl.illumination, is_smooth) {
            (Some(3), true) => Surface::Mirror { reflectance },
            _ => Surface::Conductor { reflectance, roughness: self.roughness() },
        }
    }

    /// True if `illum 3` or `5` is a pure reflection: by `Ks` over a dark base, or by `Kd` without `Ks`.
    fn is_mirror(&mut self, base: &ColorInput) -> bool {
        let Some(model @ (3 | 5)) = self.mtl.illumination else { return false };
        let is_dark = base.texture.is_none() && f64::from(base.value.max_element()) <= DARK_BASE;
        let (what, is_mirror) = match (self.has_specular(), is_dark) {
            (true, true) if is_black(base) => return true,
            (true, true) => ("is a mirror: its dark `Kd` is left out", true),
            (true, false) => ("is a reflection `Ks` over its `Kd`", false),
            (false, _) if is_pbr(self.mtl) || self.mtl.metallic.is_some() => {
                ("is as `Pr` and `Pm` specify", false)
            }
            (false, _) if base.texture.is_some() => ("is diffuse: there is no `Ks` to reflect by", false),
            (false, _) => ("is a mirror of colour `Kd`: there is no `Ks`", true),
        };
        let name = &self.mtl.name;
        self.notes.add(1, format!("material `{name}` with `illum {model}` {what}"));
        is_mirror
    }

    /// `illum 3` reflects equally at all angles, `illum 5` by Fresnel's law; `Pr` makes either rough.
    fn mirror(&mut self, base: ColorInput) -> Surface {
        let reflectance = if self.has_specular() { self.specular() } else { base };
        let is_smooth = self.mtl.roughness.unwrap_or(0.0) == 0.0 && !self.mtl.has_map(MapKind::Roughness);
        match (self.mtl.illumination, is_smooth) {
            (Some(3), true) => Surface::Mirror { reflectance },
            (_, true) => Surface::Conductor { reflectance, roughness: 0.0.into() },
            (_, false) => Surface::Conductor { reflectance, roughness: self.roughness() },
        }
    }

    /// Diffuse, under a coat if there is one.
    fn coated(&mut self, base: ColorInput, metallic: ScalarInput) -> Surface {
        let (specular, ior) = if self.has_specular() {
            (self.specular(), self.plastic_ior())
        } else if is_pbr(self.mtl) {
            let ior = self.ior().unwrap_or(DEFAULT_IOR);
            (Rgb::splat(fresnel(ior) as f32).into(), Some(ior as f32))
        } else {
            (Rgb::ZERO.into(), None)
        };
        if is_black(&specular) && metallic.value == 0.0 {
            return Surface::Diffuse { reflectance: base };
        }
        Surface::Glossy { base, specular, roughness: self.roughness(), metallic, ior }
    }

    /// Index of a coat whose `Ks` is the Fresnel reflectance of its `Ni`.
    fn plastic_ior(&mut self) -> Option<f32> {
        let ior = self.ior()?;
        let specular = self.mtl.specular.filter(|_| !self.mtl.has_map(MapKind::Specular))?;
        let expected = fresnel(ior);
        let agrees = specular.iter().all(|ks| (ks - expected).abs() <= PLASTIC_TOLERANCE * expected);
        (matches!(self.mtl.illumination, Some(2 | 3 | 5)) && expected > 0.0 && agrees).then_some(ior as f32)
    }

    /// True if `Ks` counts: `illum 0` and `1` have no highlight without `Pr` or `Pm`.
    fn has_specular(&self) -> bool {
        let mtl = self.mtl;
        let is_matt = matches!(mtl.illumination, Some(0 | 1)) && !is_pbr(mtl);
        !is_matt && (mtl.specular.is_some() || mtl.has_map(MapKind::Specular))
    }

    fn specular(&mut self) -> ColorInput {
        let texture = self.textures.colour(self.mtl.map(MapKind::Specular));
        let factor = self.factor("Ks", self.mtl.specular, [1.0; 3], texture.is_some());
        ColorInput { value: self.reflectance("Ks", factor), texture }
    }
}

fn is_black(colour: &ColorInput) -> bool {
    colour.value == Rgb::ZERO
}

/// Fresnel reflectance at normal incidence.
fn fresnel(ior: f64) -> f64 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

#[cfg(test)]
mod tests;
