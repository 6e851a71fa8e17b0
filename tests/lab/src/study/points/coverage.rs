//! Counts of the intervals that hold the true value, by tenths of the points in order of brightness.

use halflight_core::PointIrradiance;
use halflight_core::estimate::{NORMAL_95, student_quantile};
use serde_json::{Value, json};

/// Replicates of a point: parts of its samples in a row.
pub(super) const REPLICATES: u32 = 16;

/// Parts of the points.
const TENTHS: usize = 10;

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

/// Intervals of one kind that hold, by tenth.
#[derive(Clone, Copy, Default)]
struct Held([u64; TENTHS]);

impl Held {
    fn all(&self, counts: &[u64; TENTHS]) -> f64 {
        self.0.iter().sum::<u64>() as f64 / counts.iter().sum::<u64>().max(1) as f64
    }

    /// Share and number of the worst tenth, from the darkest on.
    fn worst(&self, counts: &[u64; TENTHS]) -> (f64, usize) {
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
    held: [Held; 3],
    /// Sums of half-widths, pooled and by samples.
    widths: [f64; 2],
}

impl<'t> Coverage<'t> {
    pub(super) fn new(truth: &'t [f64]) -> Self {
        let mut order: Vec<usize> = (0..truth.len()).collect();
        order.sort_by(|a, b| truth[*a].total_cmp(&truth[*b]));
        let mut tenths = vec![0; truth.len()];
        order.iter().enumerate().for_each(|(rank, point)| tenths[*point] = rank * TENTHS / truth.len());
        Self { truth, tenths, counts: [0; TENTHS], held: [Held::default(); 3], widths: [0.0; 2] }
    }

    /// Counts the intervals of a bake.
    pub(super) fn count(&mut self, values: impl Iterator<Item = PointIrradiance>, samples: &Samples) {
        for (i, value) in values.enumerate() {
            let (truth, tenth) = (self.truth[i], self.tenths[i]);
            self.counts[tenth] += 1;
            let mut count = |kind: usize, holds: bool| self.held[kind].0[tenth] += u64::from(holds);
            count(0, (f64::from(value.lower)..=f64::from(value.upper)).contains(&truth));
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
            "{name:16} {spp:5}  {:12.3}  {worst:7.3} ({tenth:2})  {:5.2}  {:14.3}  {of_samples:5.3}  {:17.3}  {:5.3}",
            pooled.all(counts),
            widths[0] / widths[1],
            samples.all(counts),
            replicates.all(counts),
            replicates.worst(counts).0,
        )
    }

    pub(super) fn object(&self, name: &str, spp: u32) -> Value {
        let Self { counts, held, widths, .. } = self;
        let share = |held: &Held| {
            let tenths: Vec<f64> = held.0.iter().zip(counts).map(|(h, c)| *h as f64 / *c as f64).collect();
            json!({ "held": held.all(counts), "tenths": tenths })
        };
        json!({
            "scene": name,
            "spp": spp,
            "points": self.truth.len(),
            "pooled": share(&held[0]),
            "samples": share(&held[1]),
            "replicates": share(&held[2]),
            "width": widths[0] / widths[1],
        })
    }
}
