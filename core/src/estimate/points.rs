//! Intervals of values at points from the film alone: variance pooled over near points, with a trend in the
//! brightness of the neighbours (after the moderated variances of Smyth 2004).
//!
//! Most points have not met rare light, and their own samples do not show its variance; those of near points
//! do. For a block of points with the half-means A and B, which are independent of each other:
//!
//! 1. m = (A + B) / 2, and v = (A − B)² / 4, of which the expectation is the variance of m. The density bias
//!    of photons adds its square to v, the product of its estimates by the halves. v̄ is the mean over the
//!    block.
//! 2. k, the mean of m over the nearest other points. The expected v of a point rises with k: β is the slope
//!    of v over m, and τ = max(1 + β (k − m̄) / v̄, 1 / 10). The m of a point is correlated with its own v,
//!    that of its neighbours is not.
//! 3. V = v̄ τ (8 + min(v / (v̄ τ), 50)) / 9. The interval is m ± t₉ √V, and not below 0.
//!
//! Quarters of the samples have a better count of degrees of freedom, but are no independent estimates: those
//! of a half share its stratification and its photons.

use super::student::{NORMAL_95, student_quantile};
use crate::film::Pixel;
use crate::light::luminance;
use glam::Vec3;
use libm::sqrtf;

/// Points whose variances are pooled.
pub const POOLED_POINTS: usize = 64;

/// Neighbours whose mean gives the trend.
const NEIGHBOURS: usize = 6;

/// Smallest expected variance of a point in means of its block.
const LEAST_TREND: f32 = 0.1;

/// Degrees of freedom of the block and of the halves of a point.
const POOLED_FREEDOM: f32 = 8.0;
const OWN_FREEDOM: f32 = 1.0;

/// Largest variance of a point in expected ones: a single firefly is no variance.
const MOST_OWN: f32 = 50.0;

/// Position and normal of a point.
pub(super) type Place = (Vec3, Vec3);

/// Sums of the luminance of a point.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Mean of both halves.
    mean: f32,
    /// Its squared error by their difference and by the density bias.
    square: f32,
}

impl Sums {
    fn of(pixel: &Pixel) -> Option<Self> {
        if pixel.even.count() == 0 || pixel.odd.count() == 0 {
            return None;
        }
        let [even, odd] = [pixel.even.mean(), pixel.odd.mean()].map(luminance);
        let square = 0.25 * (even - odd) * (even - odd) + pixel.even.blur() * pixel.odd.blur();
        Some(Self { mean: 0.5 * (even + odd), square: square.max(0.0) })
    }
}

/// Writes the variance of the mean luminance of each of at most [`POOLED_POINTS`] `pixels` to `variances`;
/// infinite where a half has no sample.
pub fn point_variances(pixels: &[Pixel], place: impl Fn(usize) -> Place, variances: &mut [f32]) {
    variances.fill(f32::INFINITY);
    let count = pixels.len().min(POOLED_POINTS);
    let mut points = [None; POOLED_POINTS];
    let mut places = [(Vec3::ZERO, Vec3::ZERO); POOLED_POINTS];
    for (i, pixel) in pixels.iter().enumerate().take(count) {
        (points[i], places[i]) = (Sums::of(pixel), place(i));
    }
    let known = || points.iter().flatten();
    let number = known().count();
    if number == 0 {
        return;
    }
    let mean_of = |value: fn(&Sums) -> f32| known().map(value).sum::<f32>() / number as f32;
    let (mean, pooled) = (mean_of(|p| p.mean), mean_of(|p| p.square));
    let slope = {
        let square: f32 = known().map(|p| (p.mean - mean) * (p.mean - mean)).sum();
        let product: f32 = known().map(|p| (p.mean - mean) * (p.square - pooled)).sum();
        if square > 0.0 { (product / square).max(0.0) } else { 0.0 }
    };
    for (i, variance) in variances.iter_mut().enumerate().take(count) {
        let Some(point) = points[i] else { continue };
        if pooled <= 0.0 {
            *variance = 0.0;
            continue;
        }
        let around = mean_around(&points[..count], &places[..count], i).unwrap_or(mean);
        let expected = pooled * (1.0 + slope * (around - mean) / pooled).max(LEAST_TREND);
        let own = (point.square / expected).min(MOST_OWN);
        *variance = expected * (POOLED_FREEDOM + OWN_FREEDOM * own) / (POOLED_FREEDOM + OWN_FREEDOM);
    }
}

/// Half of the width of the 95 % interval of a mean of this variance.
pub fn half_width(variance: f32) -> f32 {
    let freedom = f64::from(POOLED_FREEDOM + OWN_FREEDOM);
    sqrtf(variance) * student_quantile(NORMAL_95, freedom) as f32
}

/// Mean of the [`NEIGHBOURS`] points nearest to point `i`. A point of the opposite normal counts as further
/// by the size of the block.
fn mean_around(points: &[Option<Sums>], places: &[Place], i: usize) -> Option<f32> {
    let (position, normal) = places[i];
    let size = places.iter().map(|(p, _)| p.distance_squared(position)).fold(0.0, f32::max);
    let mut nearest = [(f32::INFINITY, 0.0); NEIGHBOURS];
    for (j, (point, (p, n))) in points.iter().zip(places).enumerate() {
        let Some(point) = point.filter(|_| j != i) else { continue };
        let distance = p.distance_squared(position) + 0.5 * size * (1.0 - n.dot(normal));
        if nearest[NEIGHBOURS - 1].0 <= distance {
            continue;
        }
        let mut entry = (distance, point.mean);
        for slot in &mut nearest {
            if entry.0 < slot.0 {
                core::mem::swap(slot, &mut entry);
            }
        }
    }
    let found = nearest.iter().take_while(|(distance, _)| *distance < f32::INFINITY);
    let (sum, count) = found.fold((0.0, 0), |(sum, count), (_, mean)| (sum + mean, count + 1));
    (count > 0).then(|| sum / count as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::film::Dropped;
    use crate::sampling::Random;
    use std::vec::Vec;

    /// Fraction of intervals that hold over 64 blocks of 64 points in a row with 64 samples each: `light` of
    /// position 0 to 1 in the block and two random numbers, of mean `truth`.
    fn coverage(light: impl Fn(f32, [f32; 2]) -> f32, truth: impl Fn(f32) -> f32) -> f64 {
        let mut held = 0;
        for block in 0..64u32 {
            let random = Random::new(7, block);
            let at = |i: usize| i as f32 / 63.0;
            let pixels: Vec<Pixel> = (0..64usize)
                .map(|i| {
                    let mut pixel = Pixel::default();
                    for sample in 0..64u32 {
                        let number = (i as u32 * 64 + sample) * 2;
                        let u = [random.single(number), random.single(number + 1)];
                        pixel.add(sample, Rgb::splat(light(at(i), u)), &mut Dropped::default());
                    }
                    pixel
                })
                .collect();
            let mut variances = [0.0; 64];
            point_variances(&pixels, |i| (Vec3::X * at(i), Vec3::Z), &mut variances);
            for (i, (pixel, variance)) in pixels.iter().zip(variances).enumerate() {
                held += usize::from((pixel.mean().x - truth(at(i))).abs() <= half_width(variance));
            }
        }
        held as f64 / 4096.0
    }

    #[test]
    fn intervals_of_even_light_hold() {
        let held = coverage(|_, [u, _]| 0.5 + u, |_| 1.0);
        assert!((0.92..0.98).contains(&held), "{held}");
    }

    #[test]
    fn intervals_hold_where_most_points_have_not_met_the_light() {
        // One sample in a hundred has 25: half of the points have none.
        let held = coverage(|_, [u, v]| 0.5 + u + if v < 0.01 { 25.0 } else { 0.0 }, |_| 1.25);
        assert!((0.92..=1.0).contains(&held), "{held}");
        let ramp = coverage(|at, [u, v]| 0.5 + u + if v < 0.04 * at { 25.0 } else { 0.0 }, |at| 1.0 + at);
        assert!((0.92..=1.0).contains(&ramp), "{ramp}");
    }

    #[test]
    fn points_without_two_halves_have_no_interval() {
        let mut pixels = [Pixel::default(); 3];
        for sample in [0, 2] {
            pixels[0].add(sample, Rgb::ONE, &mut Dropped::default());
        }
        let mut variances = [0.0; 3];
        point_variances(&pixels, |_| (Vec3::ZERO, Vec3::Z), &mut variances);
        assert!(variances.iter().all(|variance| *variance == f32::INFINITY));
        for sample in 0..2 {
            pixels[1].add(sample, Rgb::ONE, &mut Dropped::default());
        }
        point_variances(&pixels, |_| (Vec3::ZERO, Vec3::Z), &mut variances);
        assert_eq!(variances[1], 0.0);
    }
}
