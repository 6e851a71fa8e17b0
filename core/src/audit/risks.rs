//! Risks of pixels: where the records of a cache disagree, some are wrong.

use crate::bsdf::Features;
use crate::cache::irradiance::IrradianceCache;
use crate::light::luminance;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::Executor;
use crate::transport::cached::gather::GatherPoint;
use crate::transport::cached::placement::{PIXELS, ProgressiveOrder, Via};
use crate::transport::{Counters, PathIntegrator};

/// Most pixels with an own risk; in larger pictures neighbours share one.
const MOST_RISKS: u64 = 1 << 16;

/// Most steps of their order. A picture that is so long and narrow that it has more is audited without risks.
const MOST_STEPS: u64 = 1 << 20;

/// Risks are relative to the irradiance, but at least to this fraction of its mean.
const MIN_IRRADIANCE: f64 = 0.1;

/// Relative upper estimates of the squared bias of each pixel, 0 where it is unknown.
#[derive(Clone, Copy, Debug)]
pub struct Risks<'m> {
    /// Risks of squares, row by row.
    values: &'m [f32],
    /// Side of a square in pixels.
    step: u32,
    /// Squares across.
    across: u32,
}

impl<'m> Risks<'m> {
    /// Risks of squares of `step` pixels, `across` of them in a row.
    pub(super) fn new(values: &'m [f32], step: u32, across: u32) -> Self {
        Self { values, step: step.max(1), across }
    }

    /// Risk of the pixel in this column and row.
    pub(super) fn at(&self, [x, y]: [u32; 2]) -> f32 {
        let square = (y / self.step) as usize * self.across as usize + (x / self.step) as usize;
        self.values.get(square).copied().unwrap_or(0.0)
    }

    /// Memory of the risks of a picture of `size` pixels, and memory that their estimate borrows besides.
    pub(super) fn footprint(size: [u32; 2]) -> [Footprint; 2] {
        let Some(Squares { step, order }) = Squares::of(size) else { return [Footprint::default(); 2] };
        let [across, down] = size.map(|side| side.div_ceil(step) as usize);
        let borrowed = Footprint::default().slice::<[f32; 2]>(order.len() as usize);
        [Footprint::default().slice::<f32>(across * down), borrowed]
    }

    /// Relative variance of the values of the records of `caches`, which `tracer` sees in a picture of `size`
    /// pixels. `None` if the executor ends early.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less memory than the risks and their estimate take.
    pub fn of_caches<F: Features>(
        tracer: &PathIntegrator<F>,
        caches: [&IrradianceCache; 2],
        size: [u32; 2],
        arena: &mut Arena<'m>,
        executor: &mut impl Executor,
    ) -> Result<Option<Self>, OutOfMemory> {
        let Some(Squares { step, order }) = Squares::of(size) else { return Ok(None) };
        let [across, down] = size.map(|side| side.div_ceil(step));
        let risks = arena.slice::<f32>(across as usize * down as usize)?;
        let found = arena.scratch().slice::<[f32; 2]>(order.len() as usize)?;
        found.fill([0.0; 2]);
        let passed = executor.pass(found.chunks_mut(PIXELS), |task, out, _| {
            let (mut counters, mut points) = (Counters::default(), [GatherPoint::NONE; PIXELS]);
            let first = (task * PIXELS) as u64;
            tracer.places(&order, first, (0, Via::Specular), &mut points, &mut counters);
            for (out, point) in out.iter_mut().zip(&points).filter(|(_, point)| point.is_some()) {
                *out = record_mean_and_variance(point, caches);
            }
            Ok(counters)
        })?;
        if !passed.is_complete {
            return Ok(None);
        }
        let known = || found.iter().filter(|[value, _]| *value > 0.0);
        let mean = known().map(|[value, _]| f64::from(*value)).sum::<f64>() / known().count().max(1) as f64;
        let dark = MIN_IRRADIANCE * mean;
        let dark = (dark * dark) as f32;
        risks.fill(0.0);
        for (i, [value, variance]) in found.iter().enumerate().filter(|(_, [value, _])| *value > 0.0) {
            let Some((x, y)) = order.pixel(i as u64) else { continue };
            if let Some(risk) = risks.get_mut((y / step * across + x / step) as usize) {
                *risk = variance / (value * value + dark);
            }
        }
        Ok(Some(Self::new(risks, step, across)))
    }
}

/// Squares of pixels with one risk each.
struct Squares {
    step: u32,
    order: ProgressiveOrder,
}

impl Squares {
    /// Squares of a picture of this size; `None` of one that is too narrow.
    fn of([width, height]: [u32; 2]) -> Option<Self> {
        let mut step = 1;
        while u64::from(width.div_ceil(step)) * u64::from(height.div_ceil(step)) > MOST_RISKS {
            step *= 2;
        }
        let order = ProgressiveOrder::new(width, height, step);
        (order.len() <= MOST_STEPS).then_some(Self { step, order })
    }
}

/// Weighted mean of the values of both caches' records at a point, and their variance.
fn record_mean_and_variance(point: &GatherPoint, caches: [&IrradianceCache; 2]) -> [f32; 2] {
    let (mut sum, mut squares, mut weights) = (0.0, 0.0, 0.0);
    for cache in caches {
        cache.visit_values(&point.query(), |value, weight| {
            let value = luminance(value);
            sum += weight * value;
            squares += weight * value * value;
            weights += weight;
        });
    }
    if weights <= 0.0 {
        return [0.0; 2];
    }
    let mean = sum / weights;
    [mean, (squares / weights - mean * mean).max(0.0)]
}
