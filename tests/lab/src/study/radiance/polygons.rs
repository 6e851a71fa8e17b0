//! Exact coefficients of light from polygons, one of which may hide others.
//!
//! A polygon of radiance 1 covers an area P of the disk of directions. With the antiderivative G(q) = ∫₀¹ t
//! Z(tq) dt Green's theorem gives ∫_P Z dx dy = ∮ G (x dy - y dx), whose edges are great circles, integrated
//! by Gauss's rule in f64. Derivatives are central differences of these coefficients.

use glam::DVec3;
use halflight_core::cache::radiance::zernike::{COUNT_MAX, DEGREE_MAX, index};
use halflight_test_support::polygon::edges;
use std::sync::LazyLock;

/// Factors of r^(d - m - 2s) in G_d^m w^-m, with the norm of the function, for all d and m >= 0.
static ANTIDERIVATIVES: LazyLock<Vec<(usize, usize, Vec<f64>)>> = LazyLock::new(|| {
    let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
    let all = (0..=DEGREE_MAX).flat_map(|d| (d % 2..=d).step_by(2).map(move |m| (d, m)));
    all.map(|(d, m)| {
        let kinds = if m == 0 { 1.0 } else { 2.0 };
        let norm = (kinds * (d + 1) as f64 / core::f64::consts::PI).sqrt();
        let factor = |s: usize| {
            let sign = if s.is_multiple_of(2) { norm } else { -norm };
            let below = factorial(s) * factorial((d + m) / 2 - s) * factorial((d - m) / 2 - s);
            sign * factorial(d - s) / below / (d - 2 * s + 2) as f64
        };
        (d, m, (0..=(d - m) / 2).map(factor).collect())
    })
    .collect()
});

/// Nodes and weights of Gauss's rule of eight points on [0, 1].
const GAUSS: [[f64; 2]; 8] = [
    [0.019_855_071_751_231_9, 0.050_614_268_145_188_1],
    [0.101_666_761_293_186_6, 0.111_190_517_226_687_2],
    [0.237_233_795_041_835_5, 0.156_853_322_938_943_6],
    [0.408_282_678_752_175_1, 0.181_341_891_689_181],
    [0.591_717_321_247_825, 0.181_341_891_689_181],
    [0.762_766_204_958_164_5, 0.156_853_322_938_943_6],
    [0.898_333_238_706_813_4, 0.111_190_517_226_687_2],
    [0.980_144_928_248_768_1, 0.050_614_268_145_188_1],
];

/// Pieces of an edge for Gauss's rule.
const PIECES: usize = 6;

/// Coefficients of a polygon of radiance `radiance` above the floor, seen from the origin. Polygons that are
/// clockwise count as negative.
pub(super) fn add_coefficients(polygon: &[DVec3], radiance: f64, out: &mut [f64; COUNT_MAX]) {
    for (a, b) in edges(polygon) {
        for (w, step) in nodes(a, b) {
            add_point(w, radiance * (w.x * step.y - w.y * step.x), out);
        }
    }
}

/// Directions from `a` to `b` on their great circle, and the steps dw of an integral over it.
pub(super) fn nodes(a: DVec3, b: DVec3) -> impl Iterator<Item = (DVec3, DVec3)> {
    let (a, b) = (a.normalize(), b.normalize());
    (0..PIECES).flat_map(move |piece| {
        GAUSS.map(|[node, weight]| {
            // w = chord/|chord|, and its derivative.
            let chord = a.lerp(b, (piece as f64 + node) / PIECES as f64);
            let length = chord.length();
            let w = chord / length;
            (w, weight / PIECES as f64 / length * (b - a).reject_from_normalized(w))
        })
    })
}

/// Adds G of all functions at the direction `w`, times `area`.
fn add_point(DVec3 { x, y, .. }: DVec3, area: f64, out: &mut [f64; COUNT_MAX]) {
    let r2 = x * x + y * y;
    let mut powers = [[1.0, 0.0]; DEGREE_MAX + 1];
    for m in 1..powers.len() {
        let [re, im] = powers[m - 1];
        powers[m] = [re * x - im * y, re * y + im * x];
    }
    for (d, m, factors) in ANTIDERIVATIVES.iter() {
        let radial = factors.iter().fold(0.0, |sum, factor| sum * r2 + factor);
        let (cos, sin) = (index(*d, *m as isize), index(*d, -(*m as isize)));
        if *m > 0 {
            out[sin] += area * radial * powers[*m][1];
        }
        out[cos] += area * radial * powers[*m][0];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;
    use halflight_test_support::polygon::{distance, irradiance};

    /// A square above the origin, against midpoints of the disk with the functions of the core.
    #[test]
    fn coefficients_are_integrals_over_the_polygon() {
        let square = [[0.5, -0.2], [0.9, 0.7], [-0.3, 0.8], [-0.4, -0.1]].map(|[x, y]| DVec3::new(x, y, 0.6));
        let mut exact = [0.0; COUNT_MAX];
        add_coefficients(&square, 2.0, &mut exact);
        const N: usize = 600;
        let mut sums = [0.0; COUNT_MAX];
        for at in 0..N * N {
            let q = [at % N, at / N].map(|k| (2.0 * k as f64 + 1.0) / N as f64 - 1.0);
            let z2 = 1.0 - q[0] * q[0] - q[1] * q[1];
            if z2 > 0.0 && distance(&square, DVec3::new(q[0], q[1], z2.sqrt())).is_some() {
                let values = halflight_core::cache::radiance::zernike::values(8, q.map(|x| x as f32));
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += 2.0 * 4.0 / (N * N) as f64 * f64::from(value);
                }
            }
        }
        for (exact, sum) in exact.iter().zip(sums) {
            assert!((exact - sum).abs() < 2e-3, "{exact} {sum}");
        }
        // Degree 0 is Lambert's formula over √π.
        let lambert = irradiance(&square, DVec3::Z);
        assert!((exact[0] - 2.0 * lambert / PI.sqrt()).abs() < 1e-12, "{} {lambert}", exact[0]);
    }
}
