//! `[[light]]` and `[environment]`: lights that have no surface.

use super::values::{BRIGHTEST, Colour, Degrees, Matrix, Number, Rotation};
use super::{LoadError, Source};
use crate::load::map::Map;
use crate::load::transform::{SceneTransform, direction as direction_between};
use glam::{DMat3, Mat3};
use halflight_core::Rgb;
use halflight_core::scene::PointLight;
use serde::Deserialize;
use toml::Spanned;

/// Kinds of `[[light]]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    /// Shines alike in all directions.
    Point,
    /// Shines into a cone.
    Spot,
    /// Parallel, from infinitely far.
    Directional,
}

/// A light without surface; which keys it needs depends on its kind.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightEntry {
    /// Which keys are needed.
    pub kind: LightKind,
    /// Where a point or spot light is.
    pub position: Option<[Number; 3]>,
    /// Where a spot or directional light shines to: a direction,
    pub direction: Option<[Number; 3]>,
    /// or, for a spot light, a point.
    pub look_at: Option<[Number; 3]>,
    /// Radiant intensity of a point or spot light, W/sr.
    pub intensity: Option<Colour>,
    /// Irradiance of a directional light on a surface that faces it, W/m².
    pub irradiance: Option<Colour>,
    /// Half-angle of a spot's cone, where it has faded to nothing.
    pub outer_degrees: Option<Degrees>,
    /// Half-angle up to which it is full; three quarters of the outer one.
    pub inner_degrees: Option<Degrees>,
}

/// What is seen where nothing is.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentEntry {
    /// Radiance, or factor on the map; 1.
    pub radiance: Option<Colour>,
    /// A latitude-longitude picture.
    pub map: Option<Spanned<String>>,
    /// Turns the map in the world.
    pub rotate: Option<Spanned<Rotation>>,
    /// From directions of the map to those of the world, instead of `rotate`: rows of a matrix whose
    /// translation does not count.
    pub to_world: Option<Spanned<Matrix>>,
}

/// An environment whose map has been found.
#[derive(Clone, Debug)]
pub(in crate::load) struct EnvironmentChange {
    pub(in crate::load) radiance: Rgb,
    pub(in crate::load) map: Option<Map>,
    pub(in crate::load) to_map: Mat3,
}

/// How far a matrix may be from a rotation: files carry six or more digits.
const ROTATION_TOLERANCE: f64 = 1e-4;

impl EnvironmentEntry {
    pub(super) fn resolved(&self, source: &Source) -> Result<EnvironmentChange, LoadError> {
        let to_world = match (&self.rotate, &self.to_world) {
            (None, None) => DMat3::IDENTITY,
            (Some(rotate), None) => rotate.get_ref().matrix(),
            (None, Some(matrix)) => {
                let linear = matrix.get_ref().linear();
                if !(linear * linear.transpose()).abs_diff_eq(DMat3::IDENTITY, ROTATION_TOLERANCE) {
                    let problem = "the matrix of the environment does not keep angles and lengths";
                    return Err(source.error(
                        matrix.span(),
                        problem,
                        "give a rotation, or one with a reflection",
                    ));
                }
                linear
            }
            (Some(_), Some(matrix)) => {
                let problem = "the environment is turned in two ways";
                return Err(source.error(matrix.span(), problem, "give either `rotate` or `to_world`"));
            }
        };
        let map = self.map.as_ref().map(|path| source.map(path)).transpose()?;
        Ok(EnvironmentChange {
            radiance: rgb(self.radiance.map_or([1.0; 3], Colour::channels)),
            map,
            to_map: to_world.transpose().as_mat3(),
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
    let needs = |key: &str| {
        let problem = format!("this {} light needs `{key}`", format!("{:?}", light.kind).to_lowercase());
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
        Ok(rgb(channels))
    };
    let direction = |from: Option<[f64; 3]>| {
        let (from, to) = match (light.direction, light.look_at, from) {
            (Some(direction), None, _) => ([0.0; 3], direction),
            (None, Some(look_at), Some(from)) => (from, look_at),
            _ => return Err(needs(if from.is_some() { "direction` or `look_at" } else { "direction" })),
        };
        direction_between(from, to.map(f64::from)).map(|unit| unit.as_vec3()).ok_or_else(|| {
            source.error(entry.span(), "the direction of this light is zero", "give it a length")
        })
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
