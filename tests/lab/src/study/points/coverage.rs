//! Counts of the intervals that hold the true value, by tenths of the points in order of brightness and by
//! regions of near points.

use halflight_core::estimate::{NORMAL_95, student_quantile};
use halflight_core::{IrradiancePoint, PointIrradiance};
use serde_json::{Value, json};

/// Replicates of a point: parts of its samples in a row.
pub(super) const REPLICATES: u32 = 16;

/// Parts of the points.
const TENTHS: usize = 10;
const REGIONS: usize = 16;

/// Single samples of all points so far.
pub(super) struct Samples {
    /// Sums of luminance after each sample, from none on.
    sums: Vec<Vec<f64>>,
    /// Sums of squares.
    squares: Vec<f64>,
}

impl Samples {
    pub(super) fn new(points: usize) -> Self {
        Self { sums: vec![vec![0.0; points]], squares: vec![0.0; points] }
    }

    /// Adds the last sample of `values`.
    pub(super) fn add(&mut self, values: impl Iterator<Item = PointIrradiance>) {
        let sums: Vec<f64> =
            values.map(|value| f64::from(value.value()) * f64::from(value.samples)).collect();
        let before = self.sums.last().expect("the first sums are of no sample");
        for (square, (sum, before)) in self.squares.iter_mut().zip(sums.iter().zip(before)) {
            *square += (sum - before) * (sum - before);
        }
        self.sums.push(sums);
    }

    /// Half-widths at point `i` by its samples and by their replicates.
    fn half_widths(&self, i: usize) -> [f64; 2] {
        let count = self.sums.len() - 1;
        let mean = self.sums[count][i] / count as f64;
        let variance = (self.squares[i] / count as f64 - mean * mean).max(0.0) / (count as f64 - 1.0);
        let part = count / REPLICATES as usize;
        let means = (0..REPLICATES as usize).map(|replicate| {
            (self.sums[(replicate + 1) * part][i] - self.sums[replicate * part][i]) / part as f64
        });
        let freedom = f64::from(REPLICATES) - 1.0;
        let of_replicates = means.map(|replicate| (replicate - mean).powi(2)).sum::<f64>()
            / (freedom * f64::from(REPLICATES));
        let half = |variance: f64, freedom| variance.sqrt() * student_quantile(NORMAL_95, freedom);
        [half(variance, count as f64 - 1.0), half(of_replicates, freedom)]
    }
}

/// Intervals of one kind that hold, by part.
#[derive(Clone, Copy)]
struct Held<const PARTS: usize>([u64; PARTS]);

impl<const PARTS: usize> Held<PARTS> {
    fn all(&self, counts: &[u64; PARTS]) -> f64 {
        self.0.iter().sum::<u64>() as f64 / counts.iter().sum::<u64>().max(1) as f64
    }

    /// Share and number of the worst part, from the first on.
    fn worst(&self, counts: &[u64; PARTS]) -> (f64, usize) {
        let shares = self.0.iter().zip(counts).map(|(held, count)| *held as f64 / (*count).max(1) as f64);
        shares.zip(1..).min_by(|a, b| a.0.total_cmp(&b.0)).expect("there are ten")
    }
}

/// Coverage of pooled intervals, of samples and of replicates.
pub(super) struct Coverage<'t> {
    truth: &'t [f64],
    /// Tenth of each point.
    tenths: Vec<usize>,
    counts: [u64; TENTHS],
    held: [Held<TENTHS>; 3],
    /// Region of each point, and pooled intervals by region.
    regions: Vec<usize>,
    region_counts: [u64; REGIONS],
    region_held: Held<REGIONS>,
    /// Sums of half-widths, pooled and by samples.
    widths: [f64; 2],
}

impl<'t> Coverage<'t> {
    pub(super) fn new(truth: &'t [f64], points: &[IrradiancePoint]) -> Self {
        let parts = |order: Vec<usize>, count: usize| {
            let mut parts = vec![0; truth.len()];
            order.iter().enumerate().for_each(|(rank, point)| parts[*point] = rank * count / truth.len());
            parts
        };
        let mut order: Vec<usize> = (0..truth.len()).collect();
        order.sort_by(|a, b| truth[*a].total_cmp(&truth[*b]));
        Self {
            truth,
            tenths: parts(order, TENTHS),
            counts: [0; TENTHS],
            held: [Held([0; TENTHS]); 3],
            regions: parts(along_curve(points), REGIONS),
            region_counts: [0; REGIONS],
            region_held: Held([0; REGIONS]),
            widths: [0.0; 2],
        }
    }

    /// Counts the intervals of a bake.
    pub(super) fn count(&mut self, values: impl Iterator<Item = PointIrradiance>, samples: &Samples) {
        for (i, value) in values.enumerate() {
            let (truth, tenth) = (self.truth[i], self.tenths[i]);
            self.counts[tenth] += 1;
            let mut count = |kind: usize, holds: bool| self.held[kind].0[tenth] += u64::from(holds);
            let holds = (f64::from(value.lower)..=f64::from(value.upper)).contains(&truth);
            count(0, holds);
            self.region_counts[self.regions[i]] += 1;
            self.region_held.0[self.regions[i]] += u64::from(holds);
            let own = samples.half_widths(i);
            for (kind, half) in own.into_iter().enumerate() {
                count(1 + kind, (f64::from(value.value()) - truth).abs() <= half);
            }
            self.widths[0] += f64::from(value.upper - value.value());
            self.widths[1] += own[0];
        }
    }

    pub(super) fn line(&self, name: &str, spp: u32) -> String {
        let Self { counts, held: [pooled, samples, replicates], widths, .. } = self;
        let ((worst, tenth), of_samples) = (pooled.worst(counts), samples.worst(counts).0);
        format!(
            "{name:16} {spp:5}  {:12.3}  {worst:7.3} ({tenth:2})  {:6.3}  {:5.2}  {:14.3}  {of_samples:5.3}  {:17.3}  {:5.3}",
            pooled.all(counts),
            self.region_held.worst(&self.region_counts).0,
            widths[0] / widths[1],
            samples.all(counts),
            replicates.all(counts),
            replicates.worst(counts).0,
        )
    }

    pub(super) fn object(&self, name: &str, spp: u32) -> Value {
        let Self { counts, held, widths, .. } = self;
        let share = |held: &Held<TENTHS>| {
            let tenths: Vec<f64> = held.0.iter().zip(counts).map(|(h, c)| *h as f64 / *c as f64).collect();
            json!({ "held": held.all(counts), "tenths": tenths })
        };
        json!({
            "scene": name,
            "spp": spp,
            "points": self.truth.len(),
            "pooled": share(&held[0]),
            "worst_region": self.region_held.worst(&self.region_counts).0,
            "samples": share(&held[1]),
            "replicates": share(&held[2]),
            "width": widths[0] / widths[1],
        })
    }
}

/// Numbers of `points` along a Z-curve.
fn along_curve(points: &[IrradiancePoint]) -> Vec<usize> {
    let ends = |axis: usize| {
        let of = points.iter().map(|point| point.position[axis]);
        (of.clone().fold(f32::INFINITY, f32::min), of.fold(f32::NEG_INFINITY, f32::max))
    };
    let ends = [0, 1, 2].map(ends);
    let size = ends.iter().map(|(low, high)| high - low).fold(f32::MIN_POSITIVE, f32::max);
    let key = |point: &IrradiancePoint| {
        let cell = [0, 1, 2].map(|axis| ((point.position[axis] - ends[axis].0) / size * 1023.0) as u32);
        let bits = (0..10usize)
            .flat_map(|bit| [0, 1, 2usize].map(|axis| (cell[axis] >> bit & 1) << (3 * bit + axis)));
        bits.fold(0, |key, bit| key | bit)
    };
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|point| key(&points[*point]));
    order
}
