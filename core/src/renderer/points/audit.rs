//! Audit of points by a cache: the squared relative bias, from some points that are path traced as well
//! (docs/decisions/error-estimate.md).

use super::film::{OFFSET, PointFilm};
use super::layout::Layout;
use crate::bsdf::Features;
use crate::estimate::{BiasEstimate, PixelBias};
use crate::film::{PIXELS_PER_TILE, Pixel, TILE};
use crate::findings::{Decision, Finding, Value};
use crate::light::luminance;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::{Executor, IrradiancePoints, RenderState, Round, Shard};
use crate::transport::{Counters, IrradiancePoint};

/// Points that are path traced, at most a quarter of all.
const AUDITED: usize = 512;
const LEAST_STEP: usize = 4;

/// Samples of all points for each of an audit.
const SAMPLES_PER_AUDIT: usize = 5;

/// Numbers of the random numbers of audited points, apart from those of all others.
const NUMBERS: u32 = 1 << 31;

/// Squared relative bias.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Bias {
    /// Ends of its 95 % interval. The upper one enters the intervals of points.
    pub(super) lower: f64,
    pub(super) upper: f64,
}

/// Path-traced copies of some points of a film.
pub(super) struct PointAudit<'a> {
    /// In the order of the film.
    points: &'a [IrradiancePoint],
    state: RenderState<'a>,
    /// Points of the film for each of them.
    step: usize,
    /// Samples of each for one of the film.
    ratio: u32,
}

/// Points of the film for each audited one, and their number.
fn spread(pixels: usize) -> (usize, usize) {
    let step = pixels.div_ceil(AUDITED).max(LEAST_STEP);
    (step, pixels / step)
}

impl<'a> PointAudit<'a> {
    /// Memory of the audit of a film of this layout.
    pub(super) fn footprint(layout: &Layout) -> Footprint {
        let count = spread(layout.pixels()).1;
        RenderState::footprint(TILE, height(count)).slice::<IrradiancePoint>(count)
    }

    /// An audit without samples of the points of `film`.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`PointAudit::footprint`].
    pub(super) fn new(film: &PointFilm, arena: &mut Arena<'a>) -> Result<Self, OutOfMemory> {
        let pixels = film.layout.pixels();
        let (step, count) = spread(pixels);
        let points = arena.slice::<IrradiancePoint>(count)?;
        for (slot, point) in points.iter_mut().zip(film.points.iter().skip(step / 2).step_by(step)) {
            *slot = point.numbered(NUMBERS | point.number);
        }
        let state = RenderState::new(TILE, height(count), Shard::WHOLE, arena)?;
        let ratio = (pixels / (SAMPLES_PER_AUDIT * count.max(1))).max(1) as u32;
        Ok(Self { points, state, step, ratio })
    }

    /// Brings the audit to as many samples as belong to `samples` of the film, in steps of `step`.
    pub(super) fn sample<F: Features>(
        &mut self,
        method: &IrradiancePoints<F>,
        executor: &mut impl Executor,
        (samples, step): (u32, u32),
    ) -> Result<(), OutOfMemory> {
        let target = samples.saturating_mul(self.ratio);
        let round = &mut Round { executor, state: &mut self.state, target, step };
        method.sample_by_paths(self.points, round)
    }

    /// Rays of the audit.
    pub(super) fn counters(&self) -> Counters {
        self.state.counters
    }

    /// The bias of `film`; `None` before enough samples.
    pub(super) fn bias(&self, film: &PointFilm) -> Option<Bias> {
        let pixels = &film.state.film.pixels()[..film.layout.pixels()];
        let mean = film.mean();
        let audited = self.state.film.pixels().iter().take(self.points.len());
        let pairs = pixels.iter().skip(self.step / 2).step_by(self.step).zip(audited);
        let found = pairs.filter_map(|(pixel, truth)| bias_of(pixel, truth, f64::from(OFFSET) * mean));
        let of = |bias| (PixelBias { bias, deviation: 0.0, variances: [0.0; 2] }, 1.0);
        let estimate = BiasEstimate::of(found.map(of))?;
        Some(Bias { lower: estimate.lower, upper: estimate.upper })
    }

    /// Finding on the `bias`.
    pub(super) fn finding(&self, bias: Option<Bias>) -> Finding {
        Finding::new("audit", Decision::Used, "the intervals have the bias of the cache")
            .with("points", Value::Count(self.points.len() as u64))
            .with("samples", Value::Count(self.state.spp().into()))
            .with_some("bias", bias.map(|bias| Value::Fraction(libm::sqrt(bias.upper))))
    }
}

/// Squared bias of the luminance of a pixel over the square of its value and of `offset`, by the halves of
/// its `truth`; `None` if a half has no sample.
fn bias_of(pixel: &Pixel, truth: &Pixel, offset: f64) -> Option<f64> {
    let halves = [&pixel.even, &pixel.odd, &truth.even, &truth.odd];
    if halves.iter().any(|half| half.count() == 0) {
        return None;
    }
    let [a, b, u, v] = halves.map(|half| f64::from(luminance(half.mean())));
    let value = 0.5 * (a + b);
    let square = 0.5 * ((a - u) * (b - v) + (a - v) * (b - u));
    Some(square / (value * value + offset * offset)).filter(|bias| bias.is_finite())
}

/// Rows of pixels for so many points.
fn height(count: usize) -> u32 {
    TILE * count.div_ceil(PIXELS_PER_TILE).max(1) as u32
}
