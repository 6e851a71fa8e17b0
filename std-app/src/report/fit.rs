//! How fast the error falls: the slope of a straight line through the curve of error against time on
//! logarithmic axes, with its interval.
//!
//! The points of a curve are not independent: each picture holds the samples of all before it. The error of a
//! mean of samples over the time t is W(t)/t, W a random walk, so two of them, at times s < t, have the
//! correlation √(s/t), and their squares s/t. That is a Markov chain in log t; subtracting from each point
//! what the one before foretells leaves independent ones, to which ordinary least squares applies. Logarithms of
//! errors stray equally, whatever the error: all points have the same weight.

/// A point of a curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Seconds.
    pub(super) seconds: f64,
    /// The error.
    pub(super) error: f64,
}

/// The line error = exp(level) · seconds^slope.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub(super) level: f64,
    pub(super) slope: f64,
    /// Where the slope lies with 95 % confidence.
    pub(super) interval: [f64; 2],
    /// Seconds from which on points were taken.
    pub(super) from: f64,
}

/// What is fitted: from the last point over this.
const DECADE: f64 = 10.0;

/// Points below which a slope has no interval worth telling.
const FEWEST: usize = 5;

impl Fit {
    /// Through the points of the last decade of time, or the last six, for the first samples often tell of a start
    /// and not of a pace. The points are in the order of time; those that have no logarithm are left out. `None`
    /// where there are fewer than five.
    pub(super) fn through(points: impl Iterator<Item = Point>) -> Option<Fit> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let mut points: Vec<Point> = points.filter(|p| positive(p.seconds) && positive(p.error)).collect();
        let decade = points.last()?.seconds / DECADE;
        let first = points.partition_point(|point| point.seconds < decade);
        points.drain(..first.min(points.len().saturating_sub(FEWEST + 1)));
        if points.len() < FEWEST {
            return None;
        }
        let values = |p: &Point| [1.0, p.seconds.ln(), p.error.ln()];
        // [Σ a², Σ a b, Σ b²], [Σ a y, Σ b y, Σ y²] of the independent rows (a, b, y).
        let (mut xx, mut xy) = ([0.0; 3], [0.0; 3]);
        let mut before: Option<&Point> = None;
        for point in &points {
            let mut row = values(point);
            if let Some(before) = before {
                let correlation = (before.seconds / point.seconds).min(MOST_ALIKE);
                let foretold = values(before);
                let rest = (1.0 - correlation * correlation).sqrt();
                row = core::array::from_fn(|i| (row[i] - correlation * foretold[i]) / rest);
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
        let reach = student_95(freedom) * (residual * xx[0] / determinant).sqrt();
        Some(Fit { level, slope, interval: [slope - reach, slope + reach], from: points[0].seconds })
    }

    /// The error after `seconds`.
    pub(super) fn at(&self, seconds: f64) -> f64 {
        (self.level + self.slope * seconds.ln()).exp()
    }

    /// Seconds until the error is `error`; infinite where it never falls.
    pub(super) fn when(&self, error: f64) -> f64 {
        if self.slope < 0.0 { ((error.ln() - self.level) / self.slope).exp() } else { f64::INFINITY }
    }
}

/// Correlation of two rounds at almost the same time.
const MOST_ALIKE: f64 = 1.0 - 1e-9;

/// The 97.5 % quantile of Student's t with `freedom` ≥ 3 degrees of freedom, to 1 % (Cornish–Fisher expansion:
/// Abramowitz and Stegun 26.7.5).
fn student_95(freedom: f64) -> f64 {
    let z: f64 = 1.959_964;
    let terms = [
        (z.powi(3) + z) / 4.0,
        (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0,
        (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0,
    ];
    z + terms[0] / freedom + terms[1] / freedom.powi(2) + terms[2] / freedom.powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(seconds: f64, error: f64) -> Point {
        Point { seconds, error }
    }

    #[test]
    fn a_power_law_is_found_again() {
        let points = (0..12).map(|i| f64::from(1 << i)).map(|t| point(t, 0.3 * t.powf(-0.8)));
        let fit = Fit::through(points).unwrap();
        assert!((fit.slope + 0.8).abs() < 1e-9 && (fit.at(1.0) - 0.3).abs() < 1e-9);
        assert!(fit.interval[1] - fit.interval[0] < 1e-6);
        assert!((fit.when(fit.at(77.0)) - 77.0).abs() < 1e-6);
    }

    #[test]
    fn what_has_no_slope_has_no_fit() {
        let falling = |n: i32| (1..=n).map(|i| point(f64::from(i), 1.0 / f64::from(i)));
        assert!(Fit::through(falling(4)).is_none() && Fit::through(falling(5)).is_some());
        assert!(Fit::through((0..9).map(|_| point(1.0, 0.5))).is_none(), "all at one time");
        assert!(Fit::through((1..9).map(|i| point(f64::from(i), 0.0))).is_none(), "no error");
        assert!(Fit::through((1..9).map(|i| point(f64::from(i), f64::NAN))).is_none());
        let rising = Fit::through((1..9).map(|i| point(f64::from(i), f64::from(i)))).unwrap();
        assert_eq!(rising.when(0.1), f64::INFINITY);
    }

    #[test]
    fn students_quantiles_are_those_of_the_tables() {
        for (freedom, expected) in [(3.0, 3.182), (5.0, 2.571), (10.0, 2.228), (30.0, 2.042), (1e6, 1.960)] {
            assert!((student_95(freedom) / expected - 1.0).abs() < 0.01, "{freedom}");
        }
    }

    /// Renders of 200 independent pixels, whose halves are random walks; the slope is −1 by construction. The
    /// chance that an honest 95 % interval misses it in more than 36 or fewer than 8 of 400 renders is below 1e-3.
    #[test]
    fn the_interval_holds_the_slope_as_often_as_it_says() {
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
