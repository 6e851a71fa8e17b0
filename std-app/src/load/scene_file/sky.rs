//! `[sky]`: a clear sky with a sun, by place and time or by the direction of the sun.

use super::light::EnvironmentChange;
use super::values::Reflectance;
use super::{LoadError, Source};
use crate::load::MORE_MEMORY;
use crate::load::transform::direction;
use crate::memory::Budget;
use crate::picture::{Picture, Samples};
use crate::sky::position::{Moment, SunPosition};
use crate::sky::{self, Dome};
use crate::values::{Latitude, Longitude, NotNegative, Number, Turbidity};
use glam::{DMat3, DVec3};
use halflight_core::Rgb;
use halflight_core::scene::DistantDisc;
use serde::Deserialize;
use toml::Spanned;

/// A clear sky.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkyEntry {
    /// Day of the Gregorian calendar, `"2024-06-21"`.
    pub date: Option<Spanned<String>>,
    /// Time of the day with its offset from universal time, `"15:30+02:00"`.
    pub time: Option<Spanned<String>>,
    /// Degrees, north positive.
    pub latitude: Option<Latitude>,
    /// Degrees, east positive.
    pub longitude: Option<Longitude>,
    /// Direction to the sun, instead of date, time and place.
    pub sun: Option<Spanned<[Number; 3]>>,
    /// 1 (pure air) to 10 (haze); 3 by default.
    pub turbidity: Option<Turbidity>,
    /// Reflectance of the ground; 0.2 by default.
    pub ground_albedo: Option<Reflectance>,
    /// Factor on the light of sky and sun; 1 by default.
    pub intensity: Option<NotNegative>,
    /// Further factor on the light of the sun; 1 by default, 0 for a sky without the sun.
    pub sun_intensity: Option<NotNegative>,
    /// Direction to the zenith; +y by default.
    pub up: Option<Spanned<[Number; 3]>>,
    /// Horizontal direction to the north; −z by default.
    pub north: Option<Spanned<[Number; 3]>>,
}

/// Largest `intensity` and `sun_intensity`: the sun stays below the largest radiance.
const LARGEST_FACTOR: f64 = 1e6;

/// Sine of the angle between `up` and `north` below which the compass is undefined.
const PARALLEL: f64 = 1e-6;

/// Elevation in degrees up to which rounding counts as the horizon.
const HORIZON: f64 = -1e-4;

/// Axes of the world: north, up, east.
fn axes(sky: &SkyEntry, source: &Source) -> Result<DMat3, LoadError> {
    let unit = |axis: &Option<Spanned<[Number; 3]>>, default: DVec3| match axis {
        None => Ok(default),
        Some(axis) => direction([0.0; 3], axis.get_ref().map(f64::from))
            .ok_or_else(|| source.error(axis.span(), "this direction is zero", "give it a length")),
    };
    let up = unit(&sky.up, DVec3::Y)?;
    // With another `up` −z need not be horizontal.
    let default = if up.cross(DVec3::NEG_Z).length() > PARALLEL { DVec3::NEG_Z } else { DVec3::Y };
    let north = unit(&sky.north, default)?;
    let east = north.cross(up);
    match (east.length() > PARALLEL, &sky.north) {
        (true, _) => {
            let east = east.normalize();
            Ok(DMat3::from_cols(up.cross(east), up, east))
        }
        (false, north) => {
            let span = north.as_ref().map(Spanned::span).unwrap_or_default();
            let help = "give `north` as a horizontal direction";
            Err(source.error(span, "`north` and `up` of the sky are parallel", help))
        }
    }
}

/// Numbers between separators, of which each has a number of digits.
fn digits(text: &str, widths: &[usize], separator: char) -> Option<Vec<u32>> {
    let parts: Vec<&str> = text.split(separator).collect();
    let is_number = |(part, width): (&&str, &usize)| {
        part.len() == *width && part.bytes().all(|byte| byte.is_ascii_digit())
    };
    let fits = parts.len() <= widths.len() && parts.iter().zip(widths).all(is_number);
    if fits { parts.iter().map(|part| part.parse().ok()).collect() } else { None }
}

/// Hours of universal time since midnight of the date of `HH:MM[:SS](Z|±HH:MM)`.
fn hours(text: &str) -> Option<f64> {
    let at = text.find(['Z', '+', '-'])?;
    let (clock, offset) = text.split_at(at);
    let hours = |text: &str, widths: &[usize]| {
        let numbers = digits(text, widths, ':')?;
        let [hour, minute] = [*numbers.first()?, *numbers.get(1)?];
        let second = numbers.get(2).copied().unwrap_or(0);
        (hour < 24 && minute < 60 && second < 60)
            .then(|| f64::from(hour) + f64::from(minute) / 60.0 + f64::from(second) / 3600.0)
    };
    let offset = match offset.split_at(1) {
        ("Z", "") => 0.0,
        ("+", offset) => hours(offset, &[2, 2])?,
        ("-", offset) => -hours(offset, &[2, 2])?,
        _ => return None,
    };
    Some(hours(clock, &[2, 2, 2])? - offset)
}

impl SkyEntry {
    /// Elevation and azimuth of the sun, and the world directions of `axes`.
    fn position(
        &self,
        entry: &Spanned<Self>,
        axes: DMat3,
        source: &Source,
    ) -> Result<SunPosition, LoadError> {
        let by_place = (&self.date, &self.time, self.latitude, self.longitude);
        match (&self.sun, by_place) {
            (Some(sun), (None, None, None, None)) => {
                let towards = direction([0.0; 3], sun.get_ref().map(f64::from)).ok_or_else(|| {
                    source.error(sun.span(), "the direction of the sun is zero", "give it a length")
                })?;
                let [north, up, east] = (axes.transpose() * towards).to_array();
                let elevation = up.atan2(north.hypot(east)).to_degrees();
                Ok(SunPosition { elevation, azimuth: east.atan2(north).to_degrees() })
            }
            (None, (Some(date), Some(time), Some(latitude), Some(longitude))) => {
                let hours = hours(time.get_ref().trim()).ok_or_else(|| {
                    let problem = "this is no time of the day with an offset from universal time";
                    source.error(time.span(), problem, "write it like \"15:30+02:00\" or \"13:30:00Z\"")
                })?;
                let date_of = |text: &str| {
                    let numbers = digits(text, &[4, 2, 2], '-')?;
                    let [year, month, day] = numbers[..] else { return None };
                    Moment::new(i32::try_from(year).ok()?, month, day, hours)
                };
                let moment = date_of(date.get_ref().trim()).ok_or_else(|| {
                    let problem = "the calendar has no such day between 1600 and 2400";
                    source.error(date.span(), problem, "write it like \"2024-06-21\"")
                })?;
                Ok(moment.sun(latitude.into(), longitude.into()))
            }
            (None, _) => {
                let problem = "the position of the sun is unknown";
                let help = "give `sun`, or `date`, `time`, `latitude` and `longitude`";
                Err(source.error(entry.span(), problem, help))
            }
            (Some(sun), _) => {
                let help = "give either `sun`, or `date`, `time`, `latitude` and `longitude`";
                Err(source.error(sun.span(), "the position of the sun is given in two ways", help))
            }
        }
    }
}

/// The environment of a sky. Its map takes memory of `budget`.
pub(super) fn environment(
    entry: &Spanned<SkyEntry>,
    budget: &mut Budget,
    source: &Source,
) -> Result<EnvironmentChange, LoadError> {
    let sky = entry.get_ref();
    let axes = axes(sky, source)?;
    let SunPosition { elevation, azimuth } = sky.position(entry, axes, source)?;
    if elevation < HORIZON {
        let problem = format!("the sun is {:.2} degrees below the horizon", -elevation);
        let help = "the model is one of the day: choose another time, date or direction";
        return Err(source.error(entry.span(), problem, help));
    }
    let factor = |factor: Option<NotNegative>, key: &str| match factor.map_or(1.0, f64::from) {
        factor if factor <= LARGEST_FACTOR => Ok(factor),
        _ => {
            let problem = format!("`{key}` of the sky is larger than {LARGEST_FACTOR:e}");
            Err(source.error(entry.span(), problem, "it is a factor on the light of a real sky"))
        }
    };
    let intensity = factor(sky.intensity, "intensity")?;
    let of_sun = intensity * factor(sky.sun_intensity, "sun_intensity")?;
    let turbidity = sky.turbidity.map_or(DEFAULT_TURBIDITY, f64::from);
    let albedo = sky.ground_albedo.map_or([DEFAULT_ALBEDO; 3], Reflectance::channels);
    budget.take(sky::MAP_BYTES).map_err(|why| {
        source.error(entry.span(), format!("no room for the map of the sky: {why}"), MORE_MEMORY)
    })?;
    let irradiance = sky::irradiance(elevation, turbidity).map(|channel| channel * of_sun);
    // The model is without intensity: so is the light of the sun on its ground.
    let on_ground = if intensity > 0.0 { irradiance.map(|x| x / intensity) } else { [0.0; 3] };
    let dome = Dome::new(elevation.clamp(0.0, 90.0), turbidity, albedo, on_ground).map_err(|_| {
        source.error(entry.span(), "the sky is outside of the model", "see docs/scene-file.md")
    })?;
    let ((sin, cos), (east, north)) = (elevation.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
    let sun = DVec3::new(cos * north, sin, cos * east);
    let [width, height] = sky::MAP_SIZE;
    let samples = Samples::Floats { rgb: sky::map(&dome, sun), alpha: Vec::new() };
    let disc = (irradiance != [0.0; 3]).then(|| {
        let radius = sky::RADIUS_DEGREES.to_radians() as f32;
        let irradiance = Rgb::from_array(irradiance.map(|channel| channel as f32));
        DistantDisc::of_irradiance((axes * sun).normalize().as_vec3(), radius, irradiance)
    });
    Ok(EnvironmentChange {
        radiance: Rgb::splat(intensity as f32),
        map: None,
        picture: Some(Picture { width, height, samples, has_alpha: false, notes: Vec::new() }),
        to_map: axes.transpose().as_mat3(),
        disc,
    })
}

/// Turbidity of a clear day.
const DEFAULT_TURBIDITY: f64 = 3.0;

/// Reflectance of grass and soil.
const DEFAULT_ALBEDO: f64 = 0.2;
