//! `[material.NAME]`: with `kind` a new material, without it changes to the material of that name.

use super::values::{Colour, Reflectance};
use super::{LoadError, Source};
use crate::load::mtl::{MapKind, MtlMaterial};
use crate::values::{Fraction, NotNegative, Number, RefractiveIndex};
use serde::Deserialize;
use toml::Spanned;

/// Kind of a new material.
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
    /// Two parallel faces in air, as of a window.
    Pane,
}

/// Reflectance of a mirror without `color`.
const DEFAULT_MIRROR: f64 = 0.5;

/// A material; absent keys change nothing.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialEntry {
    /// Kind of a new material.
    pub kind: Option<MaterialKind>,
    /// Reflectance of a diffuse surface or of a metal (`Kd`).
    pub color: Option<Reflectance>,
    /// Texture of `color` (`map_Kd`).
    pub color_map: Option<Spanned<String>>,
    /// Reflectance of the coat at normal incidence (`Ks`).
    pub specular: Option<Reflectance>,
    /// Texture of `specular` (`map_Ks`).
    pub specular_map: Option<Spanned<String>>,
    /// Phong exponent (`Ns`); `roughness` overrides it.
    pub shininess: Option<NotNegative>,
    /// 0 smooth ... 1 rough; GGX alpha is its square (`Pr`).
    pub roughness: Option<Fraction>,
    /// Texture of `roughness` (`map_Pr`).
    pub roughness_map: Option<Spanned<String>>,
    /// 0 coat over base ... 1 metal (`Pm`).
    pub metallic: Option<Fraction>,
    /// Texture of `metallic` (`map_Pm`).
    pub metallic_map: Option<Spanned<String>>,
    /// Index of refraction (`Ni`).
    pub ior: Option<RefractiveIndex>,
    /// Factor on the transmission of glass (`Tf`), or of the body of a pane.
    pub tint: Option<Reflectance>,
    /// Probability that a ray hits the surface (`d`).
    pub opacity: Option<Fraction>,
    /// Texture of `opacity` (`map_d`).
    pub opacity_map: Option<Spanned<String>>,
    /// Emitted radiance (`Ke`).
    pub emission: Option<Colour>,
    /// Texture of `emission` (`map_Ke`).
    pub emission_map: Option<Spanned<String>>,
    /// True if the back emits too.
    pub two_sided: Option<bool>,
    /// Heights (`bump`).
    pub bump_map: Option<Spanned<String>>,
    /// Factor on the heights (`-bm`).
    pub bump_scale: Option<Number>,
    /// Tangent-space normals (`norm`).
    pub normal_map: Option<Spanned<String>>,
}

/// A change to a material, with its textures located.
#[derive(Clone, Debug)]
pub(in crate::load) struct MaterialChange {
    is_new: bool,
    change: MtlMaterial,
    two_sided: Option<bool>,
    bump_scale: Option<f64>,
}

impl MaterialEntry {
    pub(super) fn resolved(&self, source: &Source) -> Result<MaterialChange, LoadError> {
        let reflectance = |colour: Option<Reflectance>| colour.map(Reflectance::channels);
        let fraction = |fraction: Option<Fraction>| fraction.map(f64::from);
        let mut change = MtlMaterial {
            diffuse: reflectance(self.color),
            specular: reflectance(self.specular),
            emission: self.emission.map(Colour::channels),
            tint: reflectance(self.tint),
            shininess: self.shininess.map(f64::from),
            ior: self.ior.map(f64::from),
            opacity: fraction(self.opacity),
            roughness: fraction(self.roughness),
            metallic: fraction(self.metallic),
            pane: self.kind == Some(MaterialKind::Pane),
            surely_glass: self.kind == Some(MaterialKind::Glass),
            ..MtlMaterial::default()
        };
        let maps = [
            (MapKind::Diffuse, &self.color_map),
            (MapKind::Specular, &self.specular_map),
            (MapKind::Emission, &self.emission_map),
            (MapKind::Roughness, &self.roughness_map),
            (MapKind::Metallic, &self.metallic_map),
            (MapKind::Opacity, &self.opacity_map),
            (MapKind::Bump, &self.bump_map),
            (MapKind::Normal, &self.normal_map),
        ];
        for (kind, path) in maps {
            if let Some(path) = path {
                change.maps.insert(kind, source.map(path)?);
            }
        }
        if let Some(kind) = self.kind {
            kind.complete(&mut change);
        }
        let (is_new, bump_scale) = (self.kind.is_some(), self.bump_scale.map(f64::from));
        Ok(MaterialChange { is_new, change, two_sided: self.two_sided, bump_scale })
    }
}

impl MaterialKind {
    /// Sets the statements of this kind.
    fn complete(self, material: &mut MtlMaterial) {
        match self {
            Self::Diffuse => material.illumination = Some(1),
            Self::Plastic => {
                // Roughness without `specular` is a dielectric coat: see `surface`.
                material.illumination = Some(2);
                material.roughness.get_or_insert(0.0);
            }
            Self::Metal => {
                material.illumination = Some(2);
                material.metallic.get_or_insert(1.0);
                material.roughness.get_or_insert(0.0);
            }
            Self::Mirror => {
                // A mirror reflects by `Ks` and has no base.
                material.illumination = Some(3);
                let (colour, map) = (material.diffuse.take(), material.maps.remove(&MapKind::Diffuse));
                if material.specular.is_none() && !material.has_map(MapKind::Specular) {
                    let default = map.is_none().then_some([DEFAULT_MIRROR; 3]);
                    material.specular = colour.or(default);
                    material.maps.extend(map.map(|map| (MapKind::Specular, map)));
                }
            }
            Self::Glass => material.illumination = Some(7),
            // Its faces are smooth.
            Self::Pane => material.roughness = None,
        }
    }
}

impl MaterialChange {
    /// The change as statements of an MTL.
    pub(in crate::load) fn material(&self) -> &MtlMaterial {
        &self.change
    }

    /// Applies the change.
    pub(in crate::load) fn apply(&self, material: &mut MtlMaterial) {
        if self.is_new {
            *material = MtlMaterial { name: core::mem::take(&mut material.name), ..MtlMaterial::default() };
        }
        let change = self.change.clone();
        // A coat of the scene file overrides `illum`.
        let is_coated =
            change.specular.is_some() || change.has_map(MapKind::Specular) || change.shininess.is_some();
        if is_coated && matches!(material.illumination, Some(0 | 1)) {
            material.illumination = Some(2);
        }
        macro_rules! replace {
            ($($field:ident)*) => { $( material.$field = change.$field.or(material.$field); )* };
        }
        replace!(diffuse specular emission tint shininess ior opacity roughness metallic illumination);
        material.maps.extend(change.maps);
        material.surely_glass |= change.surely_glass;
        material.pane |= change.pane;
        material.surely_reflects |= change.specular.is_some();
        material.two_sided = self.two_sided.unwrap_or(material.two_sided);
        if let (Some(map), Some(scale)) = (material.maps.get_mut(&MapKind::Bump), self.bump_scale) {
            map.options.bump_multiplier = Some(scale);
        }
    }
}
