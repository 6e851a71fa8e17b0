//! The judge of random pictures: a t-test of every pixel over independent replicas, with the significance level
//! shared out over the pixels (Šidák 1967).

use halflight_core::estimate::student_quantile;

/// The probability with which a test fails that should pass. Seeds are fixed, so it either does or never does.
pub const SIGNIFICANCE: f64 = 0.01;

/// Relative rounding that even a picture without noise may have.
pub const ROUNDING: f64 = 2e-5;

/// Judges whether the mean of `replicas` (each a list of pixels) is `expected`.
///
/// # Errors
/// The worst pixel, in words.
pub fn judge(replicas: &[Vec<f64>], expected: &[f64]) -> Result<(), String> {
    let count = replicas.len() as f64;
    let each = 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / (expected.len() + 1) as f64);
    let limit = student_quantile(normal_quantile(0.5 * each), count - 1.0);
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

/// The sums of blocks of `size` × `size` pixels of a picture that is `width` pixels across, all channels.
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

/// Judges whether two lots of pictures have the same means: none of their values may be more than `widest` deviations
/// apart (Welch's t).
///
/// # Errors
/// The first value that is, in words.
pub fn agree(a: &[Vec<f64>], b: &[Vec<f64>], widest: f64) -> Result<(), String> {
    for (i, ((a, va), (b, vb))) in moments(a).into_iter().zip(moments(b)).enumerate() {
        // Values without any noise are equal up to rounding.
        let deviation = (a - b).abs() / (va + vb).sqrt().max(1e-6 * (a + b));
        if !(a == b || deviation < widest) {
            return Err(format!("value {i}: {a} and {b}, {deviation:.1} deviations"));
        }
    }
    Ok(())
}

/// Mean and variance of the mean of each value.
fn moments(pictures: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let count = pictures.len() as f64;
    let of = |i: usize| {
        let mean = pictures.iter().map(|p| p[i]).sum::<f64>() / count;
        let squares = pictures.iter().map(|p| (p[i] - mean).powi(2)).sum::<f64>();
        (mean, squares / (count * (count - 1.0)))
    };
    (0..pictures[0].len()).map(of).collect()
}

/// The value that a normal variable exceeds with probability `tail` < 0.02.
fn normal_quantile(tail: f64) -> f64 {
    let (mut low, mut high) = (2.0, 20.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if normal_tail(middle) > tail { low = middle } else { high = middle }
    }
    low
}

/// Laplace's continued fraction for the upper tail of the normal distribution.
fn normal_tail(z: f64) -> f64 {
    let density = (-0.5 * z * z).exp() / core::f64::consts::TAU.sqrt();
    density / (1..60).rev().fold(z, |fraction, i| z + f64::from(i) / fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        assert!((normal_quantile(0.005) - 2.5758).abs() < 1e-4);
    }

    #[test]
    fn a_wrong_picture_is_found() {
        let replicas: Vec<Vec<f64>> = (0..32).map(|i| vec![1.0 + 0.01 * f64::from(i % 4), 2.0]).collect();
        assert!(judge(&replicas, &[1.015, 2.0]).is_ok());
        assert!(judge(&replicas, &[1.03, 2.0]).is_err());
        assert!(judge(&replicas, &[1.015, 2.1]).is_err());
    }
}
