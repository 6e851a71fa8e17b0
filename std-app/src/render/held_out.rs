//! Held-out points of a picture, for which no record was made, with their exact indirect irradiance.

use super::RenderError;
use crate::memory::lines;
use halflight_core::Rgb;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{CellFlux, Metric, metric};
use halflight_core::memory::Arena;
use halflight_core::method::Executor;
use halflight_core::transport::cached::gather::{GatherPoint, Gathering};
use halflight_core::transport::cached::placement::{PIXELS, ProgressiveOrder, Via};
use halflight_core::transport::{Counters, PathIntegrator};

/// Strata along a side of the hemisphere at a held-out point.
pub(super) const EXACT: usize = 64;

/// Sample number reserved for held-out points.
const SAMPLE: u32 = 1000;

/// A held-out point.
pub(super) struct Point {
    pub(super) place: GatherPoint,
    /// Column and row.
    pub(super) pixel: [u32; 2],
    /// Luminance of the irradiance.
    pub(super) exact: f64,
    /// Variance of `exact`.
    pub(super) variance: f64,
}

pub(super) fn luminance(light: Rgb) -> f64 {
    f64::from(halflight_core::light::luminance(light))
}

/// Side in pixels of the squares that divide the picture into about `points` parts; a power of two.
pub(super) fn stride([width, height]: [u32; 2], points: u32) -> u32 {
    let each = f64::from(width) * f64::from(height) / f64::from(points.max(1));
    (each.sqrt() as u32).max(1).next_power_of_two()
}

/// About `points` points, spread evenly over the picture, each gathered `repeats` times and at least twice.
/// `None` if the executor ends early.
pub(super) fn held_out<F: Features>(
    tracer: &PathIntegrator<F>,
    size: [u32; 2],
    [points, repeats]: [u32; 2],
    executor: &mut impl Executor,
) -> Result<Option<Vec<Point>>, RenderError> {
    let [width, height] = size;
    let order = ProgressiveOrder::new(width, height, stride(size, points));
    let mut places = vec![GatherPoint::NONE; order.len() as usize];
    let passed = executor.pass(places.chunks_mut(PIXELS), |task, out, _| {
        let mut counters = Counters::default();
        tracer.places(&order, (task * PIXELS) as u64, (SAMPLE, Via::Specular), out, &mut counters);
        tracer.measure_overhangs(out, &mut counters);
        Ok(counters)
    })?;
    if !passed.is_complete {
        return Ok(None);
    }
    let pixel = |i: usize| order.pixel(i as u64).map_or([0; 2], |(x, y)| [x, y]);
    let places = places.into_iter().enumerate().filter(|(_, place)| place.is_some());
    let places: Vec<_> = places.map(|(i, place)| (place, pixel(i))).collect();

    let mut tables = lines(CellFlux::footprint(EXACT))?;
    let flux = CellFlux::build(EXACT, &mut Arena::over(&mut tables))?;
    let gathering =
        Gathering { flux: &flux, metric: metric::Settings::new(Metric::MinDistance, 1.0), least_pixels: 0.0 };
    // Mean and variance of the mean.
    let mut known: Vec<Option<[f64; 2]>> = vec![None; places.len()];
    let repeats = repeats.max(2);
    let passed = executor.pass(places.iter().zip(&mut known), |task, ((place, _), out), worker| {
        let mut counters = Counters::default();
        let mut found = Vec::new();
        for repeat in 0..repeats {
            // Random streams that no record uses.
            let number = 1 << 29 | (repeats * task as u32 + repeat);
            let gathered = tracer.gather(place, number, &gathering, &mut worker.scratch, &mut counters)?;
            let Some(record) = gathered else { return Ok(counters) };
            found.push(luminance(record.irradiance.into()));
        }
        let count = f64::from(repeats);
        let mean = found.iter().sum::<f64>() / count;
        let squares: f64 = found.iter().map(|found| (found - mean).powi(2)).sum();
        *out = Some([mean, squares / (count * (count - 1.0))]);
        Ok(counters)
    })?;
    if !passed.is_complete {
        return Ok(None);
    }
    let point = |((place, pixel), known): ((GatherPoint, [u32; 2]), Option<[f64; 2]>)| {
        known.map(|[exact, variance]| Point { place, pixel, exact, variance })
    };
    Ok(Some(places.into_iter().zip(known).filter_map(point).collect()))
}
