//! Held-out points of a picture, for which no record was made, with their exact indirect irradiance.

use super::Tracer;
use crate::Result;
use crate::study::threads::Threads;
use halflight::pages::Pages;
use halflight_core::Rgb;
use halflight_core::cache::irradiance::{CellFlux, Metric, metric};
use halflight_core::light;
use halflight_core::memory::Arena;
use halflight_core::method::Executor;
use halflight_core::transport::Counters;
use halflight_core::transport::cached::gather::{GatherPoint, Gathering};
use halflight_core::transport::cached::placement::{PIXELS, ProgressiveOrder, Via};

/// Strata along a side of the hemisphere at a point, and gatherings there.
pub(super) const EXACT: usize = 64;
const REPEATS: u32 = 4;

/// Sample number of no picture.
const SAMPLE: u32 = 1000;

/// A held-out point.
pub(super) struct Point {
    pub(super) place: GatherPoint,
    /// Luminance of the irradiance.
    pub(super) exact: f64,
    /// Variance of `exact`.
    pub(super) variance: f64,
}

pub(super) fn luminance(light: Rgb) -> f64 {
    f64::from(light::luminance(light))
}

/// About `count` points, spread evenly over the picture.
pub(super) fn held_out(
    tracer: &Tracer,
    [width, height]: [u32; 2],
    count: u32,
    executor: &mut Threads,
) -> Result<Vec<Point>> {
    let square = f64::from(width) * f64::from(height) / f64::from(count);
    let order = ProgressiveOrder::new(width, height, (square.sqrt() as u32).max(1).next_power_of_two());
    let mut places = vec![GatherPoint::NONE; order.len() as usize];
    // This executor never ends early.
    let _ = executor.pass(places.chunks_mut(PIXELS), |task, out, _| {
        let mut counters = Counters::default();
        tracer.places(&order, (task * PIXELS) as u64, (SAMPLE, Via::Specular), out, &mut counters);
        tracer.measure_overhangs(out, &mut counters);
        Ok(counters)
    })?;
    places.retain(GatherPoint::is_some);

    let mut tables = Pages::new(CellFlux::footprint(EXACT))?;
    let flux = CellFlux::build(EXACT, &mut Arena::over(&mut tables))?;
    let gathering =
        Gathering { flux: &flux, metric: metric::Settings::new(Metric::MinDistance, 1.0), least_pixels: 0.0 };
    let mut points: Vec<Option<Point>> = places.iter().map(|_| None).collect();
    let _ = executor.pass(places.into_iter().zip(&mut points), |task, (place, out), worker| {
        let mut counters = Counters::default();
        let mut values = Vec::new();
        for repeat in 0..REPEATS {
            // Random streams that no record uses.
            let number = 1 << 29 | (REPEATS * task as u32 + repeat);
            let gathered = tracer.gather(&place, number, &gathering, &mut worker.scratch, &mut counters)?;
            let Some(record) = gathered else { return Ok(counters) };
            values.push(luminance(record.irradiance.into()));
        }
        let count = f64::from(REPEATS);
        let exact = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|value| (value - exact).powi(2)).sum();
        *out = Some(Point { place, exact, variance: squares / (count * (count - 1.0)) });
        Ok(counters)
    })?;
    Ok(points.into_iter().flatten().collect())
}
