//! `[[light]]` and `[environment]`: lights without surface.

use super::values::{BRIGHTEST, Colour, Matrix, Rotation};
use super::{LoadError, Source};
use crate::load::map::Map;
use crate::load::texture::Content;
use crate::load::texture_set::TextureSet;
use crate::load::transform::{SceneTransform, direction as direction_between};
use crate::picture::Picture;
use crate::values::{ConeAngle, Degrees, Number};
use glam::{DMat3, Mat3};
use halflight_core::Rgb;
use halflight_core::scene::{DistantDisc, Environment, PointLight};
use serde::Deserialize;
use toml::Spanned;

/// Kinds of `[[light]]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    /// Equal intensity in all directions.
    Point,
    /// Emission into a cone.
    Spot,
    /// Parallel light.
    Directional,
}

/// A light without surface; its kind determines the keys that it needs.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightEntry {
    /// Kind of the light.
    pub kind: LightKind,
    /// Position of a point or spot light.
    pub position: Option<[Number; 3]>,
    /// Direction of the emission of a spot or directional light.
    pub direction: Option<[Number; 3]>,
    /// Point on the axis of a spot light, in place of the direction.
    pub look_at: Option<[Number; 3]>,
    /// Radiant intensity of a point or spot light, W/sr.
    pub intensity: Option<Colour>,
    /// Irradiance of a directional light on a surface that faces it, W/m².
    pub irradiance: Option<Colour>,
    /// Half-angle of the cone of a spot light.
    pub outer_degrees: Option<ConeAngle>,
    /// Half-angle of full intensity; by default three quarters of the outer one.
    pub inner_degrees: Option<Degrees>,
}

/// Light from infinity.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentEntry {
    /// Radiance, or factor on the map; 1 by default.
    pub radiance: Option<Colour>,
    /// A latitude-longitude image.
    pub map: Option<Spanned<String>>,
    /// Rotation of the map.
    pub rotate: Option<Spanned<Rotation>>,
    /// Transform of directions from the map to the world, instead of `rotate`: rows of a matrix, without its
    /// translation.
    pub to_world: Option<Spanned<Matrix>>,
}

/// An environment with a located map.
#[derive(Clone, Debug)]
pub(in crate::load) struct EnvironmentChange {
    pub(in crate::load) radiance: Rgb,
    pub(in crate::load) map: Option<Map>,
    /// A map that is no file, instead of `map`; its memory is taken.
    pub(in crate::load) picture: Option<Picture>,
    pub(in crate::load) to_map: Mat3,
    pub(in crate::load) disc: Option<DistantDisc>,
}

impl EnvironmentChange {
    /// An environment of one radiance.
    pub(in crate::load) fn of_radiance(radiance: Rgb) -> Self {
        Self { radiance, map: None, picture: None, to_map: Mat3::IDENTITY, disc: None }
    }

    /// The environment, with its map among `textures`.
    pub(in crate::load) fn in_core(self, textures: &mut TextureSet) -> Environment {
        let map = match self.picture {
            Some(picture) => Some(textures.add(picture, Content::Colour)),
            None => textures.colour(self.map.as_ref()),
        };
        Environment { radiance: self.radiance, map, to_map: self.to_map, disc: self.disc }
    }
}

/// Error of a rotation matrix: files have six or more digits.
const ROTATION_TOLERANCE: f64 = 1e-4;

impl LightEntry {
    /// A key that lights of this kind do not have, and those that they have.
    fn foreign_key(&self) -> Option<(&'static str, &'static [&'static str])> {
        let known: &[&str] = match self.kind {
            LightKind::Point => &["position", "intensity"],
            LightKind::Spot => {
                &["position", "direction", "look_at", "intensity", "outer_degrees", "inner_degrees"]
            }
            LightKind::Directional => &["direction", "irradiance"],
        };
        let keys = [
            ("position", self.position.is_some()),
            ("direction", self.direction.is_some()),
            ("look_at", self.look_at.is_some()),
            ("intensity", self.intensity.is_some()),
            ("irradiance", self.irradiance.is_some()),
            ("outer_degrees", self.outer_degrees.is_some()),
            ("inner_degrees", self.inner_degrees.is_some()),
        ];
        let foreign = keys.into_iter().find(|(key, is_given)| *is_given && !known.contains(key));
        foreign.map(|(key, _)| (key, known))
    }
}

impl EnvironmentEntry {
    pub(super) fn resolved(&self, source: &Source) -> Result<EnvironmentChange, LoadError> {
        let to_world = match (&self.rotate, &self.to_world) {
            (None, None) => DMat3::IDENTITY,
            (Some(rotate), None) => rotate.get_ref().matrix(),
            (None, Some(matrix)) => {
                let linear = matrix.get_ref().linear();
                if !(linear * linear.transpose()).abs_diff_eq(DMat3::IDENTITY, ROTATION_TOLERANCE) {
                    let problem = "the matrix of the environment does not keep angles and lengths";
                    let help = "give a rotation, or one with a reflection";
                    return Err(source.error(matrix.span(), problem, help));
                }
                linear
            }
            (Some(_), Some(matrix)) => {
                let problem = "the environment is rotated in two ways";
                return Err(source.error(matrix.span(), problem, "give either `rotate` or `to_world`"));
            }
        };
        let map = self.map.as_ref().map(|path| source.map(path)).transpose()?;
        Ok(EnvironmentChange {
            radiance: rgb(self.radiance.map_or([1.0; 3], Colour::channels)),
            map,
            picture: None,
            to_map: to_world.transpose().as_mat3(),
            disc: None,
        })
    }
}

/// The light in the coordinates of the core.
pub(super) fn light(
    entry: &Spanned<LightEntry>,
    transform: &SceneTransform,
    source: &Source,
) -> Result<PointLight, LoadError> {
    let light = entry.get_ref();
    let kind = format!("{:?}", light.kind).to_lowercase();
    if let Some((key, known)) = light.foreign_key() {
        let help = format!("it has `{}`", known.join("`, `"));
        return Err(source.error(entry.span(), format!("a {kind} light has no `{key}`"), help));
    }
    let needs = |key: &str| {
        let problem = format!("this {kind} light needs `{key}`");
        source.error(entry.span(), problem, "docs/scene-file.md has an example of each kind")
    };
    let position = || light.position.map(|p| p.map(f64::from)).ok_or_else(|| needs("position"));
    let intensity = || {
        let intensity = light.intensity.ok_or_else(|| needs("intensity"))?;
        let channels = intensity.channels().map(|x| x * transform.intensity_factor());
        if channels.iter().any(|&x| x > BRIGHTEST) {
            let most = BRIGHTEST / transform.intensity_factor();
            let problem = "the `intensity` of this light is too large for a scene of this size";
            return Err(source.error(entry.span(), problem, format!("{most:.1e} W/sr are possible here")));
        }
        if intensity.channels() != [0.0; 3] && rgb(channels) == Rgb::ZERO {
            let problem = "the `intensity` of this light is too small for a scene of this size";
            return Err(source.error(entry.span(), problem, "f32 has no number for it: give a larger one"));
        }
        Ok(rgb(channels))
    };
    let direction = |from: Option<[f64; 3]>| {
        let (from, to) = match (light.direction, light.look_at, from) {
            (Some(direction), None, _) => ([0.0; 3], direction),
            (None, Some(look_at), Some(from)) => (from, look_at),
            (Some(_), Some(_), _) => {
                let problem = "this light is directed in two ways";
                return Err(source.error(entry.span(), problem, "give either `direction` or `look_at`"));
            }
            _ => return Err(needs(if from.is_some() { "direction` or `look_at" } else { "direction" })),
        };
        let unit = direction_between(from, to.map(f64::from)).ok_or_else(|| {
            source.error(entry.span(), "the direction of this light is zero", "give it a length")
        })?;
        Ok(unit.as_vec3())
    };
    Ok(match light.kind {
        LightKind::Point => {
            PointLight::Point { position: transform.point(position()?), intensity: intensity()? }
        }
        LightKind::Spot => {
            let outer = f64::from(light.outer_degrees.ok_or_else(|| needs("outer_degrees"))?);
            let inner = light.inner_degrees.map_or(0.75 * outer, f64::from).min(outer);
            PointLight::Spot {
                position: transform.point(position()?),
                direction: direction(Some(position()?))?,
                intensity: intensity()?,
                cos_inner: inner.to_radians().cos() as f32,
                cos_outer: outer.to_radians().cos() as f32,
            }
        }
        LightKind::Directional => {
            let irradiance = light.irradiance.ok_or_else(|| needs("irradiance"))?;
            PointLight::Directional { direction: direction(None)?, irradiance: rgb(irradiance.channels()) }
        }
    })
}

fn rgb(channels: [f64; 3]) -> Rgb {
    channels.map(|x| x as f32).into()
}
