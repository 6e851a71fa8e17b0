//! A survey of the irradiance caches of a picture: where their records are and how far they reach, what error they
//! predict, and what error they have at points that no record was made for.

use super::RenderError;
use super::held_out::{Point, held_out, luminance, stride};
use super::threads::{End, Threads};
use core::time::Duration;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{IrradianceCache, Record};
use halflight_core::method::Executor;
use halflight_core::transport::cached::gather::GatherPoint;
use halflight_core::transport::cached::placement::{PIXELS, ProgressiveOrder, Via};
use halflight_core::transport::{Counters, PathIntegrator};
use std::time::Instant;

/// Maps have no more pixels than this.
const MOST_PIXELS: u64 = 1 << 21;

/// Seconds that a survey may always take.
const SHORT: f64 = 10.0;

/// Pixels of which the risk is known, at most: those of larger pictures have that of a neighbour.
const MOST_RISKS: u64 = 1 << 16;

/// Gatherings at a point of comparison.
const REPEATS: u32 = 2;

/// Errors are relative to the irradiance, or to this share of its mean where it is darker.
const DARK: f64 = 0.1;

/// Half of the width of a rim that is drawn, and the radius of a record's middle, in pixels.
const RIM: f32 = 0.6;
const MIDDLE: f32 = 1.6;

/// What of a record of the cache of even samples is at a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// Nothing.
    #[default]
    None,
    /// The rim of what it covers.
    Rim,
    /// Its place.
    Record,
}

/// What is known at a pixel of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// Geometric mean of the radii of the records that speak there, in pixels; 0 where there are none.
    pub radius: f32,
    /// Relative error that they predict.
    pub predicted: f32,
    /// What is drawn there.
    pub mark: Mark,
}

/// What is known at a point that no record was made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// Column and row.
    pub pixel: [u32; 2],
    /// By how much the mean of both caches is too bright, relative to the irradiance, or to a tenth of its mean.
    pub error: f32,
    /// What the records predict of its magnitude.
    pub predicted: f32,
}

/// See the file.
#[derive(Clone, Debug)]
pub struct Survey {
    /// Pixels of the picture along the side of one of the maps.
    pub step: u32,
    /// Pixels of the maps, across.
    pub width: u32,
    /// The maps, row by row.
    pub looks: Vec<Look>,
    /// Pixels along the side of the square that stands for a check.
    pub square: u32,
    /// The points where records reach.
    pub checks: Vec<Check>,
    /// Points in all.
    pub points: u64,
    /// Mean of what records predict at the points.
    pub predicted: f64,
    /// Mean magnitude of the errors, which has the noise of what they are compared with in it.
    pub achieved: f64,
    /// Root mean square of the relative error, without that noise.
    pub rms: f64,
    /// Root mean square of that noise.
    pub noise: f64,
    /// Seconds that the survey took.
    pub seconds: f64,
}

/// Looks at all pixels, and gathers at about `points` of them; `None` where the render is interrupted, or
/// has had so many `seconds` and this takes longer.
pub(super) fn survey<F: Features>(
    tracer: &PathIntegrator<F>,
    caches: [&IrradianceCache; 2],
    size: [u32; 2],
    (points, seconds): (u32, Option<f64>),
    executor: Threads,
) -> Result<Option<Survey>, RenderError> {
    let start = Instant::now();
    let limit = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds.max(SHORT)).ok());
    let mut executor = executor.until(End::Round(limit.and_then(|limit| start.checked_add(limit))));
    let [width, height] = size;
    let mut step = 1;
    while u64::from(width.div_ceil(step)) * u64::from(height.div_ceil(step)) > MOST_PIXELS {
        step *= 2;
    }
    let order = ProgressiveOrder::new(width, height, step);
    let mut found = vec![Look::default(); order.len() as usize];
    let passed = executor.pass(found.chunks_mut(PIXELS), |task, out, _| {
        let (mut counters, mut places) = (Counters::default(), [GatherPoint::NONE; PIXELS]);
        tracer.places(&order, (task * PIXELS) as u64, (0, Via::Specular), &mut places, &mut counters);
        tracer.look_up(&mut places, &mut counters);
        for (look, place) in out.iter_mut().zip(&places).filter(|(_, place)| place.is_some()) {
            *look = look_at(place, caches, step);
        }
        Ok(counters)
    })?;
    if !passed.is_complete {
        return Ok(None);
    }
    let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
    let mut looks = vec![Look::default(); columns as usize * rows as usize];
    for (i, look) in found.into_iter().enumerate() {
        if let Some((x, y)) = order.pixel(i as u64) {
            looks[(y / step * columns + x / step) as usize] = look;
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
        looks,
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

/// Of each pixel, row by row, the variance of what records say at the place that it shows, over the square of
/// that: where they say different things, one of them is wrong. 0 where none speaks; nothing where it was
/// interrupted. Of large pictures some pixels stand for their neighbours.
pub(super) fn risks<F: Features>(
    tracer: &PathIntegrator<F>,
    caches: [&IrradianceCache; 2],
    size: [u32; 2],
    executor: &mut impl Executor,
) -> Result<Vec<f32>, RenderError> {
    let [width, height] = size;
    let mut step = 1;
    while u64::from(width.div_ceil(step)) * u64::from(height.div_ceil(step)) > MOST_RISKS {
        step *= 2;
    }
    let order = ProgressiveOrder::new(width, height, step);
    let mut found = vec![[0.0; 2]; order.len() as usize];
    let passed = executor.pass(found.chunks_mut(PIXELS), |task, out, _| {
        let (mut counters, mut places) = (Counters::default(), [GatherPoint::NONE; PIXELS]);
        tracer.places(&order, (task * PIXELS) as u64, (0, Via::Specular), &mut places, &mut counters);
        for (out, place) in out.iter_mut().zip(&places).filter(|(_, place)| place.is_some()) {
            *out = said_at(place, caches);
        }
        Ok(counters)
    })?;
    if !passed.is_complete {
        return Ok(Vec::new());
    }
    let known = || found.iter().filter(|[said, _]| *said > 0.0);
    let mean = known().map(|[said, _]| f64::from(*said)).sum::<f64>() / known().count().max(1) as f64;
    let dark = ((DARK * mean).powi(2)) as f32;
    let mut risks = vec![0.0; width as usize * height as usize];
    for (i, [said, variance]) in found.into_iter().enumerate() {
        let Some((x, y)) = order.pixel(i as u64).filter(|_| said > 0.0) else { continue };
        for row in y..(y + step).min(height) {
            let first = row as usize * width as usize;
            let end = (x + step).min(width) as usize;
            risks[first + x as usize..first + end].fill(variance / (said * said + dark));
        }
    }
    Ok(risks)
}

/// What records of both caches say at a place in the mean, and the variance of that.
fn said_at(place: &GatherPoint, caches: [&IrradianceCache; 2]) -> [f32; 2] {
    let (mut sum, mut squares, mut weights) = (0.0, 0.0, 0.0);
    for cache in caches {
        cache.visit_values(&place.asker(), |said, weight| {
            let said = luminance(said) as f32;
            sum += weight * said;
            squares += weight * said * said;
            weights += weight;
        });
    }
    if weights <= 0.0 {
        return [0.0; 2];
    }
    let mean = sum / weights;
    [mean, (squares / weights - mean * mean).max(0.0)]
}

fn look_at(place: &GatherPoint, caches: [&IrradianceCache; 2], step: u32) -> Look {
    let (position, pixel) = (place.position(), place.pixel() * step as f32);
    let mut mark = Mark::None;
    let [even, _] = caches;
    even.visit(&place.asker(), |record, _| {
        let [r1, r2] = record.radii;
        let distance = position.distance(record.position.into());
        if distance < MIDDLE * pixel {
            mark = Mark::Record;
        } else if mark == Mark::None
            && (record.radii_to(position) - 1.0).abs() * (r1 * r2).sqrt() < RIM * pixel
        {
            mark = Mark::Rim;
        }
    });
    let radius =
        |record: &Record| (record.radii[0] * record.radii[1] / (place.pixel() * place.pixel())).sqrt();
    let [radius, predicted] = means(place, caches, |record| [radius(record).ln(), record.predicted()]);
    Look { radius: if radius.is_finite() { radius.exp() } else { 0.0 }, predicted, mark }
}

/// Means over the records that speak for a place, by their weights; not a number where there are none.
pub(super) fn means(
    place: &GatherPoint,
    caches: [&IrradianceCache; 2],
    of: impl Fn(&Record) -> [f32; 2],
) -> [f32; 2] {
    let (mut sums, mut weights) = ([0.0; 2], 0.0);
    for cache in caches {
        cache.visit(&place.asker(), |record, weight| {
            let values = of(record);
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
            weights += weight;
        });
    }
    sums.map(|sum| sum / weights)
}

/// What both caches say at a point, and the variance of the relative error by the noise of `exact`; `None` where no
/// record reaches.
fn check(point: &Point, mean: f64, caches: [&IrradianceCache; 2]) -> Option<(Check, f64)> {
    let Point { place, pixel, exact, variance } = point;
    let said = caches.map(|cache| cache.at(&place.asker()));
    let said: Vec<f64> = said.into_iter().flatten().map(|said| luminance(said.irradiance)).collect();
    if said.is_empty() {
        return None;
    }
    let found = said.iter().sum::<f64>() / said.len() as f64;
    let against = exact.max(DARK * mean).max(f64::MIN_POSITIVE);
    let [predicted, _] = means(place, caches, |record| [record.predicted(), 0.0]);
    let error = ((found - exact) / against) as f32;
    Some((Check { pixel: *pixel, error, predicted }, variance / (against * against)))
}
