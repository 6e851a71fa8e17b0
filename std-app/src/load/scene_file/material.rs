//! `[material.NAME]`: a material in plain words. Without `kind` it changes what the mesh's own material of
//! that name says; with `kind` it starts afresh.

use super::values::{Colour, Number};
use super::{LoadError, Source};
use crate::load::mtl::MtlMaterial;
use crate::load::name::Name;
use serde::Deserialize;
use toml::Spanned;

/// What kind of material starts afresh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MaterialKind {
    /// Lambert.
    Diffuse,
    /// A dielectric coat over a diffuse base.
    Plastic,
    /// A metal of `color`.
    Metal,
    /// A perfect mirror of `color`.
    Mirror,
    /// A boundary between two media.
    Glass,
}

/// Reflectance of a mirror without `color`.
const DEFAULT_MIRROR: f64 = 0.5;

/// A material in plain words; what is not given stays as it was.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialEntry {
    /// Start afresh from this kind.
    pub kind: Option<MaterialKind>,
    /// Diffuse reflectance, or that of the metal (`Kd`).
    pub color: Option<Colour>,
    /// Texture of `color` (`map_Kd`).
    pub color_map: Option<Spanned<String>>,
    /// Reflectance of the coat at normal incidence (`Ks`).
    pub specular: Option<Colour>,
    /// Texture of `specular` (`map_Ks`).
    pub specular_map: Option<Spanned<String>>,
    /// Phong exponent (`Ns`); `roughness` wins.
    pub shininess: Option<Number>,
    /// 0 smooth ... 1 rough; GGX alpha is its square (`Pr`).
    pub roughness: Option<Number>,
    /// Texture of `roughness` (`map_Pr`).
    pub roughness_map: Option<Spanned<String>>,
    /// 0 coat over base ... 1 metal (`Pm`).
    pub metallic: Option<Number>,
    /// Texture of `metallic` (`map_Pm`).
    pub metallic_map: Option<Spanned<String>>,
    /// Index of refraction (`Ni`).
    pub ior: Option<Number>,
    /// Factor on light that a glass lets through (`Tf`).
    pub tint: Option<Colour>,
    /// Probability that a ray meets the surface (`d`).
    pub opacity: Option<Number>,
    /// Texture of `opacity` (`map_d`).
    pub opacity_map: Option<Spanned<String>>,
    /// Emitted radiance (`Ke`).
    pub emission: Option<Colour>,
    /// Texture of `emission` (`map_Ke`).
    pub emission_map: Option<Spanned<String>>,
    /// Whether the back emits as well.
    pub two_sided: Option<bool>,
    /// Heights (`bump`).
    pub bump_map: Option<Spanned<String>>,
    /// Factor on the heights (`-bm`).
    pub bump_scale: Option<Number>,
    /// Tangent-space normals (`norm`).
    pub normal_map: Option<Spanned<String>>,
}

/// A change to a material, its textures found.
#[derive(Clone, Debug)]
pub(in crate::load) struct MaterialChange {
    afresh: bool,
    change: MtlMaterial,
    two_sided: Option<bool>,
    bump_scale: Option<f64>,
}

impl MaterialEntry {
    pub(super) fn resolved(&self, source: &Source) -> Result<MaterialChange, LoadError> {
        let map = |path: &Option<Spanned<String>>| path.as_ref().map(|path| source.map(path)).transpose();
        let colour = |colour: Option<Colour>| colour.map(Colour::channels);
        let number = |number: Option<Number>| number.map(f64::from);
        let mut change = MtlMaterial {
            name: Name::default(),
            diffuse: colour(self.color),
            specular: colour(self.specular),
            emission: colour(self.emission),
            tint: colour(self.tint),
            shininess: number(self.shininess),
            ior: number(self.ior),
            opacity: number(self.opacity),
            roughness: number(self.roughness),
            metallic: number(self.metallic),
            illumination: None,
            surely_glass: self.kind == Some(MaterialKind::Glass),
            two_sided: false,
            diffuse_map: map(&self.color_map)?,
            specular_map: map(&self.specular_map)?,
            emission_map: map(&self.emission_map)?,
            roughness_map: map(&self.roughness_map)?,
            metallic_map: map(&self.metallic_map)?,
            opacity_map: map(&self.opacity_map)?,
            bump_map: map(&self.bump_map)?,
            normal_map: map(&self.normal_map)?,
        };
        match self.kind {
            None => {}
            Some(MaterialKind::Diffuse) => change.illumination = Some(1),
            Some(MaterialKind::Plastic) => {
                // Roughness without `specular` is a dielectric coat: see `surface`.
                change.illumination = Some(2);
                change.roughness.get_or_insert(0.0);
            }
            Some(MaterialKind::Metal) => {
                change.illumination = Some(2);
                change.metallic.get_or_insert(1.0);
                change.roughness.get_or_insert(0.0);
            }
            Some(MaterialKind::Mirror) => {
                // A mirror reflects by `Ks` and has no base.
                change.illumination = Some(3);
                if change.specular.is_none() && change.specular_map.is_none() {
                    let plain = change.diffuse_map.is_none().then_some([DEFAULT_MIRROR; 3]);
                    change.specular = change.diffuse.take().or(plain);
                    change.specular_map = change.diffuse_map.take();
                }
                (change.diffuse, change.diffuse_map) = (None, None);
            }
            Some(MaterialKind::Glass) => change.illumination = Some(7),
        }
        let bump_scale = number(self.bump_scale);
        Ok(MaterialChange { afresh: self.kind.is_some(), change, two_sided: self.two_sided, bump_scale })
    }
}

impl MaterialChange {
    /// What is said, as statements of an MTL.
    pub(in crate::load) fn material(&self) -> &MtlMaterial {
        &self.change
    }

    /// Applies what is given.
    pub(in crate::load) fn apply(&self, material: &mut MtlMaterial) {
        if self.afresh {
            *material = MtlMaterial { name: core::mem::take(&mut material.name), ..MtlMaterial::default() };
        }
        let change = self.change.clone();
        // A coat that the scene file gives is there, whatever `illum` says.
        let is_coated =
            change.specular.is_some() || change.specular_map.is_some() || change.shininess.is_some();
        if is_coated && matches!(material.illumination, Some(0 | 1)) {
            material.illumination = Some(2);
        }
        macro_rules! replace {
            ($($field:ident),*) => { $( if change.$field.is_some() { material.$field = change.$field; } )* };
        }
        replace!(
            diffuse,
            specular,
            emission,
            tint,
            shininess,
            ior,
            opacity,
            roughness,
            metallic,
            illumination
        );
        replace!(diffuse_map, specular_map, emission_map, roughness_map, metallic_map, opacity_map);
        replace!(bump_map, normal_map);
        material.surely_glass |= change.surely_glass;
        material.two_sided = self.two_sided.unwrap_or(material.two_sided);
        if let (Some(map), Some(scale)) = (&mut material.bump_map, self.bump_scale) {
            map.options.bump_multiplier = Some(scale);
        }
    }
}
