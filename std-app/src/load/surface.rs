//! What the statements of an MTL file mean: from [`MtlMaterial`] to the core's [`Material`]. The conventions
//! are those of `docs/loading.md`; that of plastics is argued in `docs/decisions/0002-plastic-from-mtl.md`.

mod inputs;

use super::illum::{self, DARK_BASE, is_glass, is_pbr};
use super::map::Map;
use super::mtl::MtlMaterial;
use super::notes::Notes;
use super::texture_set::TextureSet;
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, Material, ScalarInput, Surface};

/// How far `Ks` may be from the Fresnel reflectance of `Ni` for a coat to be read as a dielectric: files are
/// written with two or three digits.
const PLASTIC_TOLERANCE: f64 = 0.05;
/// Index of refraction where a file has glass or a PBR coat without `Ni`.
const DEFAULT_IOR: f64 = 1.5;

/// The core's material for what the file says, with views of the textures that it needs.
pub(super) fn resolve(mtl: &MtlMaterial, textures: &mut TextureSet, notes: &mut Notes) -> Material {
    illum::note_what_is_lost(mtl, notes);
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

/// The maps of a material.
pub(super) fn maps(mtl: &MtlMaterial) -> impl Iterator<Item = &Map> {
    let MtlMaterial { diffuse_map, specular_map, emission_map, roughness_map, .. } = mtl;
    let MtlMaterial { metallic_map, opacity_map, bump_map, normal_map, .. } = mtl;
    let colours = [diffuse_map, specular_map, emission_map];
    let numbers = [roughness_map, metallic_map, opacity_map, bump_map, normal_map];
    colours.into_iter().chain(numbers).flatten()
}

/// The same, to be changed.
pub(super) fn maps_mut(mtl: &mut MtlMaterial) -> impl Iterator<Item = &mut Map> {
    let MtlMaterial { diffuse_map, specular_map, emission_map, roughness_map, .. } = mtl;
    let MtlMaterial { metallic_map, opacity_map, bump_map, normal_map, .. } = mtl;
    let colours = [diffuse_map, specular_map, emission_map];
    let numbers = [roughness_map, metallic_map, opacity_map, bump_map, normal_map];
    colours.into_iter().chain(numbers).flatten()
}

struct Resolver<'a> {
    mtl: &'a MtlMaterial,
    textures: &'a mut TextureSet,
    notes: &'a mut Notes,
}

impl Resolver<'_> {
    /// `illum` decides what nothing more precise says: `Pr`, `Pm` and their maps win, and a diffuse base stays.
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
        let roughness = match (self.mtl.roughness, &self.mtl.roughness_map) {
            (None, None) => 0.0.into(),
            _ => self.roughness(),
        };
        let tint = self.reflectance("Tf", self.mtl.tint.unwrap_or([1.0; 3]));
        Surface::Dielectric { ior: self.ior().unwrap_or(DEFAULT_IOR) as f32, tint, roughness }
    }

    /// A metal of colour `Kd`, or `Ks` where that is black or absent; a perfect mirror where `Pr` is 0.
    fn metal(&mut self, base: ColorInput) -> Surface {
        let is_absent = self.mtl.diffuse.is_none() && self.mtl.diffuse_map.is_none();
        let by_specular = self.has_specular() && (is_black(&base) || is_absent);
        let reflectance = if by_specular { self.specular() } else { base };
        if self.mtl.roughness == Some(0.0) && self.mtl.roughness_map.is_none() {
            return Surface::Mirror { reflectance };
        }
        Surface::Conductor { reflectance, roughness: self.roughness() }
    }

    /// Whether `illum 3` or `5` leaves nothing but a reflection: by `Ks`, with as good as no base, or by `Kd` alone,
    /// which is its colour then.
    fn is_mirror(&mut self, base: &ColorInput) -> bool {
        let Some(model @ (3 | 5)) = self.mtl.illumination else { return false };
        let is_dark = base.texture.is_none() && f64::from(base.value.max_element()) <= DARK_BASE;
        let (what, is_mirror) = match (self.has_specular(), is_dark) {
            (true, true) if is_black(base) => return true,
            (true, true) => ("is a mirror: its dark `Kd` is left out", true),
            (true, false) => ("is a reflection `Ks` over its `Kd`", false),
            (false, _) if is_pbr(self.mtl) || self.mtl.metallic.is_some() => {
                ("is what `Pr` and `Pm` say", false)
            }
            (false, _) if base.texture.is_some() => ("is diffuse: there is no `Ks` to reflect by", false),
            (false, _) => ("is a mirror of colour `Kd`: there is no `Ks`", true),
        };
        let name = &self.mtl.name;
        self.notes.add(1, format!("material `{name}` with `illum {model}` {what}"));
        is_mirror
    }

    /// `illum 3` reflects alike at all angles, `illum 5` by Fresnel's law; `Pr` may make either rough.
    fn mirror(&mut self, base: ColorInput) -> Surface {
        let reflectance = if self.has_specular() { self.specular() } else { base };
        let is_smooth = self.mtl.roughness.is_none_or(|pr| pr == 0.0) && self.mtl.roughness_map.is_none();
        match (self.mtl.illumination, is_smooth) {
            (Some(3), true) => Surface::Mirror { reflectance },
            (_, true) => Surface::Conductor { reflectance, roughness: 0.0.into() },
            (_, false) => Surface::Conductor { reflectance, roughness: self.roughness() },
        }
    }

    /// Diffuse, under a coat where there is one.
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

    /// The index of a coat whose `Ks` is the Fresnel reflectance of its `Ni`.
    fn plastic_ior(&mut self) -> Option<f32> {
        let ior = self.ior()?;
        let specular = self.mtl.specular.filter(|_| self.mtl.specular_map.is_none())?;
        let expected = fresnel(ior);
        let agrees = specular.iter().all(|ks| (ks - expected).abs() <= PLASTIC_TOLERANCE * expected);
        (matches!(self.mtl.illumination, Some(2 | 3 | 5)) && expected > 0.0 && agrees).then_some(ior as f32)
    }

    /// Whether `Ks` counts: `illum 0` and `1` have no highlight unless `Pr` or `Pm` speaks of one.
    fn has_specular(&self) -> bool {
        let mtl = self.mtl;
        let is_matt = matches!(mtl.illumination, Some(0 | 1)) && !is_pbr(mtl);
        !is_matt && (mtl.specular.is_some() || mtl.specular_map.is_some())
    }

    fn specular(&mut self) -> ColorInput {
        let texture = self.textures.colour(self.mtl.specular_map.as_ref());
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
