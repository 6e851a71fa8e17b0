//! Tests of random pictures: a t-test of every pixel over independent replicas, with the significance level
//! shared among the pixels (Šidák 1967).

use core::f64::consts::FRAC_PI_2;

/// Probability that a correct renderer fails a test. Seeds are fixed, so a test always passes or always
/// fails.
pub const SIGNIFICANCE: f64 = 0.01;

/// Relative rounding error allowed in pictures without noise.
pub const ROUNDING: f64 = 2e-5;

/// Judges whether the mean of `replicas` (each a list of pixels) is `expected`.
///
/// # Errors
/// Text about the first pixel that differs.
pub fn judge(replicas: &[Vec<f64>], expected: &[f64]) -> Result<(), String> {
    let count = replicas.len() as f64;
    let each = 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / (expected.len() + 1) as f64);
    let limit = student_quantile(0.5 * each, replicas.len() as u32 - 1);
    let test = |name: &str, values: &dyn Fn(&Vec<f64>) -> f64, expected: f64| {
        let mean = replicas.iter().map(values).sum::<f64>() / count;
        let variance = replicas.iter().map(|r| (values(r) - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let error = (variance / count).sqrt() * limit + ROUNDING * expected.abs();
        let off = (mean - expected).abs();
        // Also false for NaN.
        if off <= error { Ok(()) } else { Err(format!("{name}: {mean} ± {error}, expected {expected}")) }
    };
    for (pixel, &expected) in expected.iter().enumerate() {
        test(&format!("pixel {pixel}"), &|replica| replica[pixel], expected)?;
    }
    let mean = |pixels: &[f64]| pixels.iter().sum::<f64>() / pixels.len() as f64;
    test("mean of the picture", &|replica| mean(replica), mean(expected))
}

/// Sums over blocks of `size` × `size` pixels of a picture `width` pixels across, all channels.
pub fn blocks(pixels: &[[f32; 3]], width: u32, size: u32) -> Vec<f64> {
    let (across, down) = (width / size, pixels.len() as u32 / width / size);
    let mut sums = vec![0.0; (across * down * 3) as usize];
    for (i, pixel) in (0u32..).zip(pixels) {
        let block = i / width / size * across + i % width / size;
        for (channel, value) in pixel.iter().enumerate() {
            sums[block as usize * 3 + channel] += f64::from(*value);
        }
    }
    sums
}

/// Judges whether two sets of pictures have equal means: no value may differ by more than `widest` standard
/// deviations (Welch's t).
///
/// # Errors
/// Text about the first value that differs.
pub fn agree(a: &[Vec<f64>], b: &[Vec<f64>], widest: f64) -> Result<(), String> {
    for (i, ((a, va), (b, vb))) in moments(a).into_iter().zip(moments(b)).enumerate() {
        // Values without noise are equal up to rounding.
        let deviation = (a - b).abs() / (va + vb).sqrt().max(1e-6 * (a + b));
        if !(a == b || deviation < widest) {
            return Err(format!("value {i}: {a} and {b}, {deviation:.1} deviations"));
        }
    }
    Ok(())
}

/// Mean of each value over independent pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimates {
    /// Number of pictures.
    pub pictures: usize,
    /// Each value's mean, and the variance of that mean.
    pub moments: Vec<(f64, f64)>,
}

impl Estimates {
    /// Those of `pictures`, each a list of values.
    pub fn of(pictures: &[Vec<f64>]) -> Self {
        Self { pictures: pictures.len(), moments: moments(pictures) }
    }
}

/// As [`agree`], with a bias of up to `allowed(i, b)` in value `i` of `a`, where `b` is the mean of the other
/// set. The significance level is shared among the values and `comparisons` comparisons.
///
/// # Errors
/// Text about the worst value.
pub fn agree_within(
    a: &[Vec<f64>],
    b: &Estimates,
    comparisons: usize,
    allowed: impl Fn(usize, f64) -> f64,
) -> Result<(), String> {
    let a = Estimates::of(a);
    assert_eq!(a.moments.len(), b.moments.len(), "values");
    let count = comparisons * a.moments.len();
    let each = 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / count as f64);
    let [of_a, of_b] = [&a, b].map(|lot| (lot.pictures - 1) as f64);
    let moments = a.moments.iter().copied().zip(b.moments.iter().copied()).enumerate();
    let all = moments.map(|(i, ((a, va), (b, vb)))| {
        // Welch 1947; at least the degrees of freedom of the smaller set.
        let freedom = (va + vb).powi(2) / (va * va / of_a + vb * vb / of_b);
        let widest = student_quantile(0.5 * each, freedom.max(of_a.min(of_b)) as u32);
        let error = widest * (va + vb).sqrt() + ROUNDING * b.abs();
        let limit = error + allowed(i, b);
        let text = format!("value {i}: {a:.5} and {b:.5} ± {error:.5}, {:.5} allowed", allowed(i, b));
        // Black values are equal.
        let excess = if a == b { 0.0 } else { (a - b).abs() / limit };
        (excess, text)
    });
    let (excess, text) = all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
    // Also false for NaN.
    if excess <= 1.0 { Ok(()) } else { Err(format!("{excess:.2} of the limit: {text}")) }
}

/// Mean of each value, and the variance of that mean.
fn moments(pictures: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let count = pictures.len() as f64;
    let of = |i: usize| {
        let mean = pictures.iter().map(|p| p[i]).sum::<f64>() / count;
        let squares = pictures.iter().map(|p| (p[i] - mean).powi(2)).sum::<f64>();
        (mean, squares / (count * (count - 1.0)))
    };
    (0..pictures[0].len()).map(of).collect()
}

/// Quantile of Student's t with `freedom` degrees: exceeded with probability `tail` < 0.5.
fn student_quantile(tail: f64, freedom: u32) -> f64 {
    // With t = √freedom cot φ the density is a power of sin φ.
    let below = |angle: f64| {
        let at = |i: u32| (angle * f64::from(i) / f64::from(STEPS)).sin().powi(freedom as i32 - 1);
        let simpson = |i: u32| (if i % 2 == 1 { 4.0 } else { 2.0 }) * at(i);
        angle * ((1..STEPS).map(simpson).sum::<f64>() + at(0) + at(STEPS)) / f64::from(3 * STEPS)
    };
    let wanted = 2.0 * below(FRAC_PI_2) * tail;
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if below(middle) < wanted { low = middle } else { high = middle }
    }
    f64::from(freedom).sqrt() / low.tan()
}

/// Steps of Simpson's rule, an even number.
const STEPS: u32 = 256;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // The tails too, where series in the inverse of the degrees of freedom fail.
        let table = [
            (0.025, 1, 12.7062),
            (0.005, 7, 3.4995),
            (0.0005, 30, 3.6460),
            (0.0005, 2, 31.599),
            (0.025, 1000, 1.9623),
        ];
        for (tail, freedom, quantile) in table {
            assert!((student_quantile(tail, freedom) / quantile - 1.0).abs() < 5e-5, "{freedom}");
        }
    }

    #[test]
    fn a_bias_up_to_what_is_allowed_is_none() {
        let lot = |mean: f64| (0..16).map(|i| vec![mean + 0.001 * f64::from(i % 4)]).collect::<Vec<_>>();
        let judged = |mean| agree_within(&lot(mean), &Estimates::of(&lot(1.0)), 1, |_, b| 0.1 * b);
        assert!(
            judged(1.09).is_ok()
                && judged(0.91).is_ok()
                && judged(1.12).is_err()
                && judged(f64::NAN).is_err()
        );
    }

    #[test]
    fn a_wrong_picture_is_found() {
        let replicas: Vec<Vec<f64>> = (0..32).map(|i| vec![1.0 + 0.01 * f64::from(i % 4), 2.0]).collect();
        assert!(judge(&replicas, &[1.015, 2.0]).is_ok());
        assert!(judge(&replicas, &[1.03, 2.0]).is_err());
        assert!(judge(&replicas, &[1.015, 2.1]).is_err());
    }
}
