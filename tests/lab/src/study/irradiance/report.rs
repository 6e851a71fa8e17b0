//! Errors of a cache at held-out points, as text and as an object.

use super::points::{Point, luminance};
use halflight_core::cache::irradiance::{IrradianceCache, Metric, metric};
use serde_json::{Value, json};

/// Head of the table.
pub(super) const HEAD: &str =
    "metric                    error   records       RMSE     noise  1 in 100  covered  predicted   achieved";

/// Errors of one metric.
pub(super) struct MetricError {
    metric: Metric,
    /// Allowed error in the metric's unit that gives this number of records.
    error: f32,
    records: u64,
    /// Root mean squared error of indirect luminance over its mean, without the noise of the exact values.
    rmse: f64,
    /// Noise of the exact values, over the mean.
    noise: f64,
    /// 99th percentile of the error, relative to the irradiance or at least a tenth of its mean.
    worst: f64,
    /// Fraction of the points within reach of records; errors refer to these points.
    covered: f64,
    /// Mean predicted relative error at the points.
    predicted: f64,
    /// Mean error, relative to the irradiance or at least a tenth of its mean.
    achieved: f64,
}

impl MetricError {
    /// Compares a cache with the exact values.
    pub(super) fn of(settings: &metric::Settings, cache: &IrradianceCache, points: &[Point]) -> Self {
        let mean = points.iter().map(|point| point.exact).sum::<f64>() / points.len().max(1) as f64;
        let (mut squares, mut variance, mut predicted, mut relative) = (0.0, 0.0, 0.0, Vec::new());
        for Point { place, exact, variance: noise } in points {
            let Some(found) = cache.at(&place.query()) else { continue };
            let difference = luminance(found.irradiance) - exact;
            squares += difference * difference - noise;
            variance += noise;
            let (mut sum, mut weights) = (0.0, 0.0);
            cache.visit(&place.query(), |record, weight| {
                sum += weight * record.predicted();
                weights += weight;
            });
            predicted += f64::from(sum / weights);
            relative.push(difference.abs() / exact.max(0.1 * mean));
        }
        relative.sort_by(f64::total_cmp);
        let covered = relative.len();
        let count = covered.max(1) as f64;
        let over_mean = |squares: f64| (squares.max(0.0) / count).sqrt() / mean.max(f64::MIN_POSITIVE);
        Self {
            metric: settings.metric,
            error: settings.error,
            records: cache.records().len() as u64,
            rmse: over_mean(squares),
            noise: over_mean(variance),
            worst: relative.get(covered * 99 / 100).copied().unwrap_or(0.0),
            covered: covered as f64 / points.len().max(1) as f64,
            predicted: predicted / count,
            achieved: relative.iter().sum::<f64>() / count,
        }
    }

    pub(super) fn line(&self) -> String {
        format!(
            "{:<21} {:>9.2e} {:>9} {:>10.5} {:>9.5} {:>9.4} {:>6.1} % {:>10.5} {:>10.5}",
            self.metric.name(),
            self.error,
            self.records,
            self.rmse,
            self.noise,
            self.worst,
            100.0 * self.covered,
            self.predicted,
            self.achieved,
        )
    }

    pub(super) fn object(&self) -> Value {
        json!({
            "metric": self.metric.name(),
            "error": self.error,
            "records": self.records,
            "rmse": self.rmse,
            "noise": self.noise,
            "worst": self.worst,
            "covered": self.covered,
            "predicted": self.predicted,
            "achieved": self.achieved,
        })
    }
}
