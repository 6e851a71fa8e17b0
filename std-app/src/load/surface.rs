//! Meaning of MTL statements: from [`MtlMaterial`] to the core's [`Material`], by the conventions of
//! `docs/loading.md`. `docs/decisions/loading.md` explains the conventions for plastics.

mod coat;
mod inputs;

use super::illum::{self, DARK_BASE, is_glass, is_pbr};
use super::map::Map;
use super::mtl::{MapKind, MtlMaterial};
use super::notes::Notes;
use super::relief::Relief;
use super::texture_set::TextureSet;
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, Material, ScalarInput, Surface};
use inputs::hides_map;

/// Relative difference of `Ks` and the Fresnel reflectance of `Ni` up to which a coat is a dielectric: files
/// have two or three digits.
const PLASTIC_TOLERANCE: f64 = 0.05;
/// Reflectance at normal incidence of a coat whose `Ks` is 1 if `Ks` is a level: 0.04 at 0.5, as in Blender.
const LEVEL: f32 = 0.08;
/// Largest sum of `Kd` and `Ks`, if both are reflectances, rounded in the file.
const MOST_REFLECTANCE: f64 = 1.005;
/// Largest difference of the channels of a grey `Ks`.
const GREY: f64 = 0.01;
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
        if self.mtl.pane {
            return self.pane();
        }
        if is_glass(self.mtl) {
            return self.glass();
        }
        let base = self.diffuse();
        let metallic = self.metallic();
        if self.mtl.exact {
            return self.metallic_roughness(base, metallic);
        }
        if metallic.texture.is_none() && metallic.value >= 1.0 {
            self.metal(base)
        } else if metallic == 0.0.into() && self.is_mirror(&base) {
            self.mirror(base)
        } else {
            self.coated(base, metallic)
        }
    }

    fn pane(&mut self) -> Surface {
        let tint = self.reflectance("Tf", self.mtl.tint.unwrap_or([1.0; 3]));
        let ior = self.ior().unwrap_or(DEFAULT_IOR);
        if ior < 1.0 {
            self.notes.add(1, format!("pane `{}` has an index below 1: 1 is used", self.mtl.name));
        }
        Surface::Pane { ior: ior as f32, tint }
    }

    /// The metallic-roughness model of glTF: the coat does not change the light of the base.
    fn metallic_roughness(&mut self, base: ColorInput, metallic: ScalarInput) -> Surface {
        let roughness = self.roughness();
        if metallic.texture.is_none() && metallic.value >= 1.0 {
            return Surface::Conductor { reflectance: base, roughness };
        }
        let specular = if self.has_specular() {
            self.specular()
        } else {
            Rgb::splat(fresnel(self.ior().unwrap_or(DEFAULT_IOR)) as f32).into()
        };
        if is_black(&specular) && metallic.value == 0.0 {
            return Surface::Diffuse { reflectance: base };
        }
        Surface::Glossy { base, specular, roughness, metallic, ior: None }
    }

    fn glass(&mut self) -> Surface {
        let roughness = match (self.mtl.roughness, self.mtl.map(MapKind::Roughness)) {
            (None, None) => 0.0.into(),
            _ => self.roughness(),
        };
        let tint = self.reflectance("Tf", self.mtl.tint.unwrap_or([1.0; 3]));
        Surface::Dielectric { ior: self.ior().unwrap_or(DEFAULT_IOR) as f32, tint, roughness }
    }

    /// A metal of colour `Kd`, or `Ks` if `Kd` is black or absent; a perfect mirror by `illum 3` and `Pr 0`.
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
            let (specular, ior) = (self.specular(), self.plastic_ior());
            let factor = if ior.is_none() && self.specular_is_level() { LEVEL } else { 1.0 };
            (ColorInput { value: factor * specular.value, ..specular }, ior)
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

    /// True if `Ks` is the level of a highlight and no reflectance: a grey one of Phong's model (`illum 2`,
    /// or a texture without `illum`), which would reflect more than all light together with `Kd`. As a
    /// reflectance it would hide the base.
    fn specular_is_level(&mut self) -> bool {
        let mtl = self.mtl;
        let is_phong = match mtl.illumination {
            Some(model) => model == 2,
            None => mtl.has_map(MapKind::Diffuse),
        };
        let is_phong = is_phong && !is_pbr(mtl) && mtl.metallic.is_none();
        let value = |given: Option<[f64; 3]>, kind| match (given, mtl.has_map(kind)) {
            (Some(value), has_map) if !hides_map(value, has_map) => value,
            (_, has_map) => [if has_map { 1.0 } else { 0.0 }; 3],
        };
        let (kd, ks) = (value(mtl.diffuse, MapKind::Diffuse), value(mtl.specular, MapKind::Specular));
        let is_grey = ks.iter().all(|x| (x - ks[0]).abs() <= GREY);
        // Dielectrics reflect less than `LEVEL`.
        let is_too_much =
            ks[0] > f64::from(LEVEL) && kd.iter().zip(ks).any(|(kd, ks)| kd + ks > MOST_REFLECTANCE);
        // The map is last, since its texels are sampled.
        let is_grey_map = |map: &Map| self.textures.relief(map) == Some(Relief::Heights);
        let is_level = is_phong
            && !mtl.surely_reflects
            && is_grey
            && is_too_much
            && mtl.map(MapKind::Specular).is_none_or(is_grey_map);
        if is_level {
            let (name, sum) = (&mtl.name, kd[0].max(kd[1]).max(kd[2]) + ks[0]);
            let note = format!(
                "`Kd` and `Ks` of material `{name}` sum to {sum:.2}: `Ks` is the level of a highlight, and the coat \
                 reflects {LEVEL} times as much"
            );
            self.notes.add(1, note);
        }
        is_level
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
        let texture = self.specular_texture();
        let factor = self.factor("Ks", self.mtl.specular, [1.0; 3], texture.is_some());
        ColorInput { texture, ..self.reflectance("Ks", factor).into() }
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
