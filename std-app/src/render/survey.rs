//! Survey of a picture's irradiance caches: positions and radii of records, their predicted error, and their
//! error at held-out points.

use super::RenderError;
use super::deadline::End;
use super::held_out::{Point, held_out, luminance, stride};
use super::threads::Threads;
use core::time::Duration;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{IrradianceCache, Record};
use halflight_core::findings::Decision::Used;
use halflight_core::findings::{Finding, Value};
use halflight_core::method::Executor;
use halflight_core::transport::cached::gather::GatherPoint;
use halflight_core::transport::cached::placement::{PIXELS, ProgressiveOrder, Via};
use halflight_core::transport::{Counters, PathIntegrator};
use std::time::Instant;

/// Most pixels of the maps.
const MOST_PIXELS: u64 = 1 << 21;

/// Seconds that a survey may take in any case.
const MIN_SECONDS: f64 = 10.0;

/// Gatherings at each held-out point.
const REPEATS: u32 = 2;

/// Errors are relative to the irradiance, but at least to this share of its mean.
const MIN_IRRADIANCE: f64 = 0.1;

/// Half width of a drawn rim and radius of a drawn record, in pixels.
const RIM_HALF_WIDTH: f32 = 0.6;
const RECORD_RADIUS: f32 = 1.6;

/// Part of a record of the even samples' cache that a pixel shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// Nothing.
    #[default]
    None,
    /// Rim of its validity ellipse.
    Rim,
    /// Its position.
    Record,
}

/// Survey of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurveyPixel {
    /// Geometric mean of the radii of the records used there, in pixels; 0 without records.
    pub radius: f32,
    /// Relative error predicted by these records.
    pub predicted: f32,
    /// Drawn mark.
    pub mark: Mark,
}

/// Comparison at a held-out point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// Column and row.
    pub pixel: [u32; 2],
    /// Error of the mean of both caches, relative to the irradiance or at least a tenth of its mean; positive
    /// if too bright.
    pub error: f32,
    /// Magnitude of the relative error that records predict.
    pub predicted: f32,
}

/// Survey of both caches.
#[derive(Clone, Debug)]
pub struct Survey {
    /// Side in pixels of the square that a map pixel represents.
    pub step: u32,
    /// Pixels across in the maps.
    pub width: u32,
    /// Maps, row by row.
    pub pixels: Vec<SurveyPixel>,
    /// Side in pixels of the square that a check represents.
    pub square: u32,
    /// Checks at the points within reach of records.
    pub checks: Vec<Check>,
    /// Number of held-out points.
    pub points: u64,
    /// Mean predicted error at the points.
    pub predicted: f64,
    /// Mean magnitude of the errors, which includes the noise of the exact values.
    pub achieved: f64,
    /// Root mean squared relative error without this noise.
    pub rms: f64,
    /// Root mean square of this noise.
    pub noise: f64,
    /// Seconds of the survey.
    pub seconds: f64,
}

impl Survey {
    /// Finding on the errors of records.
    pub(super) fn finding(&self) -> Finding {
        let Survey { predicted, achieved, .. } = *self;
        let reason = match predicted / achieved.max(f64::MIN_POSITIVE) {
            _ if self.checks.is_empty() => "no record covers a test point",
            0.0 => "the metric predicts no error",
            ratio if ratio > 2.0 => "the error is less than half of the prediction",
            ratio if ratio < 0.5 => "the error is more than twice the prediction",
            _ => "the error is within a factor of two of the prediction",
        };
        Finding::new("cache_survey", Used, reason)
            .with("points", Value::Count(self.points))
            .with("covered", Value::Fraction(self.checks.len() as f64 / self.points.max(1) as f64))
            .with("predicted", Value::Fraction(predicted))
            .with("achieved", Value::Fraction(achieved))
            .with("rms", Value::Fraction(self.rms))
            .with("noise", Value::Fraction(self.noise))
            .with("seconds", Value::Seconds(self.seconds))
    }
}

/// Surveys all pixels and gathers at about `points` of them. `None` if interrupted, or if it takes longer
/// than the render's limit of `seconds`.
pub(super) fn survey<F: Features>(
    tracer: &PathIntegrator<F>,
    caches: [&IrradianceCache; 2],
    size: [u32; 2],
    (points, seconds): (u32, Option<f64>),
    executor: Threads,
) -> Result<Option<Survey>, RenderError> {
    let start = Instant::now();
    let limit = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds.max(MIN_SECONDS)).ok());
    let mut executor = executor.until(End::Round(limit.and_then(|limit| start.checked_add(limit))));
    let [width, height] = size;
    let mut step = 1;
    while u64::from(width.div_ceil(step)) * u64::from(height.div_ceil(step)) > MOST_PIXELS {
        step *= 2;
    }
    let order = ProgressiveOrder::new(width, height, step);
    let mut found = vec![SurveyPixel::default(); order.len() as usize];
    let passed = executor.pass(found.chunks_mut(PIXELS), |task, out, _| {
        let (mut counters, mut places) = (Counters::default(), [GatherPoint::NONE; PIXELS]);
        tracer.places(&order, (task * PIXELS) as u64, (0, Via::Specular), &mut places, &mut counters);
        tracer.measure_overhangs(&mut places, &mut counters);
        for (surveyed, place) in out.iter_mut().zip(&places).filter(|(_, place)| place.is_some()) {
            *surveyed = survey_pixel(place, caches, step);
        }
        Ok(counters)
    })?;
    if !passed.is_complete {
        return Ok(None);
    }
    let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
    let mut pixels = vec![SurveyPixel::default(); columns as usize * rows as usize];
    for (i, surveyed) in found.into_iter().enumerate() {
        if let Some((x, y)) = order.pixel(i as u64) {
            pixels[(y / step * columns + x / step) as usize] = surveyed;
        }
    }

    let points_asked = [points, REPEATS];
    let Some(points) = held_out(tracer, size, points_asked, &mut executor)? else { return Ok(None) };
    let mean = points.iter().map(|point| point.exact).sum::<f64>() / points.len().max(1) as f64;
    let checked: Vec<_> = points.iter().filter_map(|point| check(point, mean, caches)).collect();
    let count = checked.len().max(1) as f64;
    let average = |of: &dyn Fn(&(Check, f64)) -> f64| checked.iter().map(of).sum::<f64>() / count;
    let square = |(check, _): &(Check, f64)| f64::from(check.error).powi(2);
    let noise = average(&|(_, noise)| *noise);
    Ok(Some(Survey {
        step,
        width: columns,
        pixels,
        square: stride(size, points_asked[0]),
        points: points.len() as u64,
        predicted: average(&|(check, _)| check.predicted.into()),
        achieved: average(&|(check, _)| check.error.abs().into()),
        rms: (average(&square) - noise).max(0.0).sqrt(),
        noise: noise.sqrt(),
        checks: checked.into_iter().map(|(check, _)| check).collect(),
        seconds: start.elapsed().as_secs_f64(),
    }))
}

fn survey_pixel(place: &GatherPoint, caches: [&IrradianceCache; 2], step: u32) -> SurveyPixel {
    let (position, pixel) = (place.position(), place.pixel() * step as f32);
    let mut mark = Mark::None;
    let [even, _] = caches;
    even.visit(&place.query(), |record, _| {
        let [r1, r2] = record.radii;
        let distance = position.distance(record.position.into());
        if distance < RECORD_RADIUS * pixel {
            mark = Mark::Record;
        } else if mark == Mark::None
            && (record.radii_to(position) - 1.0).abs() * (r1 * r2).sqrt() < RIM_HALF_WIDTH * pixel
        {
            mark = Mark::Rim;
        }
    });
    let radius =
        |record: &Record| (record.radii[0] * record.radii[1] / (place.pixel() * place.pixel())).sqrt();
    let [radius, predicted] = means(place, caches, |record| [radius(record).ln(), record.predicted()]);
    SurveyPixel { radius: if radius.is_finite() { radius.exp() } else { 0.0 }, predicted, mark }
}

/// Weighted means over the records used at a point; NaN without records.
fn means(place: &GatherPoint, caches: [&IrradianceCache; 2], of: impl Fn(&Record) -> [f32; 2]) -> [f32; 2] {
    let (mut sums, mut weights) = ([0.0; 2], 0.0);
    for cache in caches {
        cache.visit(&place.query(), |record, weight| {
            let values = of(record);
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
            weights += weight;
        });
    }
    sums.map(|sum| sum / weights)
}

/// Comparison at a point, and the variance of its relative error by the noise of `exact`; `None` without
/// records.
fn check(point: &Point, mean: f64, caches: [&IrradianceCache; 2]) -> Option<(Check, f64)> {
    let Point { place, pixel, exact, variance } = point;
    let value = caches.map(|cache| cache.at(&place.query()));
    let value: Vec<f64> = value.into_iter().flatten().map(|value| luminance(value.irradiance)).collect();
    if value.is_empty() {
        return None;
    }
    let found = value.iter().sum::<f64>() / value.len() as f64;
    let against = exact.max(MIN_IRRADIANCE * mean).max(f64::MIN_POSITIVE);
    let [predicted, _] = means(place, caches, |record| [record.predicted(), 0.0]);
    let error = ((found - exact) / against) as f32;
    Some((Check { pixel: *pixel, error, predicted }, variance / (against * against)))
}
