//! Power law of error against time: a line through the curve on logarithmic axes, with the interval of its
//! slope.
//!
//! The points of a curve are correlated, because each picture holds the samples of all earlier ones. The
//! error of a mean over the time t is W(t)/t with a random walk W. Errors at times s < t have the correlation
//! √(s/t), and their squares s/t: a Markov chain in log t. Each point minus its prediction from the one
//! before is independent, so ordinary least squares applies. Logarithms of errors have equal variances:
//! weights are equal.

use halflight_core::estimate::{NORMAL_95, student_quantile};

/// Point of a curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Rendering time in seconds.
    pub(super) seconds: f64,
    /// relMSE.
    pub(super) error: f64,
}

/// Line error = exp(level) · seconds^slope.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub(super) level: f64,
    pub(super) slope: f64,
    /// 95 % interval of the slope.
    pub(super) interval: [f64; 2],
    /// Seconds of the first point used.
    pub(super) from: f64,
}

/// Range of times of a fit: the last point over the first.
const DECADE: f64 = 10.0;

/// Fewest points of a fit.
const MIN_POINTS: usize = 5;

/// Largest correlation, for two rounds at nearly the same time.
const MAX_CORRELATION: f64 = 1.0 - 1e-9;

impl Fit {
    /// Fit of the last decade of time or the last six points: early samples often show the start, not the
    /// rate.
    ///
    /// Points are in the order of time. Points without a logarithm are ignored. `None` below five points.
    pub(super) fn through(points: impl Iterator<Item = Point>) -> Option<Fit> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let mut points: Vec<Point> = points.filter(|p| positive(p.seconds) && positive(p.error)).collect();
        let decade = points.last()?.seconds / DECADE;
        let first = points.partition_point(|point| point.seconds < decade);
        points.drain(..first.min(points.len().saturating_sub(MIN_POINTS + 1)));
        if points.len() < MIN_POINTS {
            return None;
        }
        let values = |p: &Point| [1.0, p.seconds.ln(), p.error.ln()];
        // [Σ a², Σ a b, Σ b²], [Σ a y, Σ b y, Σ y²] of the independent rows (a, b, y).
        let (mut xx, mut xy) = ([0.0; 3], [0.0; 3]);
        let mut before: Option<&Point> = None;
        for point in &points {
            let mut row = values(point);
            if let Some(before) = before {
                let correlation = (before.seconds / point.seconds).min(MAX_CORRELATION);
                let predicted = values(before);
                let rest = (1.0 - correlation * correlation).sqrt();
                row = core::array::from_fn(|i| (row[i] - correlation * predicted[i]) / rest);
            }
            let [a, b, y] = row;
            xx = [xx[0] + a * a, xx[1] + a * b, xx[2] + b * b];
            xy = [xy[0] + a * y, xy[1] + b * y, xy[2] + y * y];
            before = Some(point);
        }
        let determinant = xx[0] * xx[2] - xx[1] * xx[1];
        if determinant <= 1e-12 * xx[0] * xx[2] {
            return None;
        }
        let level = (xx[2] * xy[0] - xx[1] * xy[1]) / determinant;
        let slope = (xx[0] * xy[1] - xx[1] * xy[0]) / determinant;
        let freedom = (points.len() - 2) as f64;
        let residual = (xy[2] - level * xy[0] - slope * xy[1]).max(0.0) / freedom;
        let width = student_quantile(NORMAL_95, freedom) * (residual * xx[0] / determinant).sqrt();
        Some(Fit { level, slope, interval: [slope - width, slope + width], from: points[0].seconds })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(seconds: f64, error: f64) -> Point {
        Point { seconds, error }
    }

    #[test]
    fn fit_recovers_a_power_law() {
        let points = (0..12).map(|i| f64::from(1 << i)).map(|t| point(t, 0.3 * t.powf(-0.8)));
        let fit = Fit::through(points).unwrap();
        assert!((fit.slope + 0.8).abs() < 1e-9 && (fit.level.exp() - 0.3).abs() < 1e-9);
        assert!(fit.interval[1] - fit.interval[0] < 1e-6);
    }

    #[test]
    fn fit_needs_five_points_at_several_times() {
        let falling = |n: i32| (1..=n).map(|i| point(f64::from(i), 1.0 / f64::from(i)));
        assert!(Fit::through(falling(4)).is_none() && Fit::through(falling(5)).is_some());
        assert!(Fit::through((0..9).map(|_| point(1.0, 0.5))).is_none(), "all at one time");
        assert!(Fit::through((1..9).map(|i| point(f64::from(i), 0.0))).is_none(), "no error");
        assert!(Fit::through((1..9).map(|i| point(f64::from(i), f64::NAN))).is_none());
        let rising = Fit::through((1..9).map(|i| point(f64::from(i), f64::from(i)))).unwrap();
        assert!(rising.slope > 0.0, "{rising:?}");
    }

    /// Errors of 200 independent pixels are random walks over time, so the slope is −1. A correct 95 %
    /// interval misses it in more than 36 or fewer than 8 of 400 renders with a probability below 1e-3.
    #[test]
    fn interval_holds_the_slope_in_95_percent_of_renders() {
        let mut state = 1u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let times: Vec<f64> =
            (0..6).map(|i| f64::from(1 << i)).chain((3..20).map(|i| 16.0 * f64::from(i))).collect();
        let mut missed = 0;
        for _ in 0..400 {
            let mut walks = vec![0.0; 200];
            let mut now = 0.0;
            let mut curve = Vec::new();
            for &time in &times {
                let step = f64::sqrt(time - now);
                walks.iter_mut().for_each(|walk| *walk += step * normal());
                let error = walks.iter().map(|walk| (walk / time).powi(2)).sum::<f64>() / 200.0;
                curve.push(point(time, error));
                now = time;
            }
            let [lower, upper] = Fit::through(curve.into_iter()).unwrap().interval;
            missed += u32::from(!(lower..=upper).contains(&-1.0));
        }
        assert!((8..=36).contains(&missed), "{missed} of 400");
    }
}
