//! Spherical harmonics with known answers.

use super::*;
use crate::Level;
use crate::cache::skies::Sky;
use crate::memory::{Arena, Line};
use core::f32::consts::TAU;
use glam::{Mat3, Vec3};
use std::vec;

#[test]
fn functions_are_orthonormal_on_the_sphere() {
    /// Midpoints of the test's own integral, at the poles.
    const MIDPOINTS: f64 = 6e-3;
    const N: usize = 256;
    let mut products = vec![[0.0f64; COUNT_MAX]; COUNT_MAX];
    for at in 0..2 * N * N {
        // Midpoints in z and azimuth.
        let z = 2.0 * ((at / (2 * N)) as f32 + 0.5) / N as f32 - 1.0;
        let (sin, cos) = (TAU * (at % (2 * N)) as f32 / (2 * N) as f32).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let values = values(ORDER_MAX, [r * cos, r * sin, z]);
        for (products, a) in products.iter_mut().zip(values) {
            for (product, b) in products.iter_mut().zip(values) {
                *product += 4.0 * core::f64::consts::PI / (2 * N * N) as f64 * f64::from(a * b);
            }
        }
    }
    for (i, products) in products.iter().enumerate() {
        for (j, product) in products.iter().enumerate() {
            assert!((product - if i == j { 1.0 } else { 0.0 }).abs() < MIDPOINTS, "{i} {j}: {product}");
        }
    }
}

/// Turned functions have the values of the functions in directions turned back.
#[test]
fn rotations_turn_functions() {
    let turns = [
        Mat3::IDENTITY,
        Mat3::from_rotation_z(0.7),
        Mat3::from_rotation_y(-1.1),
        Mat3::from_rotation_y(core::f32::consts::PI),
        Mat3::from_rotation_z(2.0) * Mat3::from_rotation_y(0.4) * Mat3::from_rotation_z(-0.3),
    ];
    let coefficients: [f32; COUNT_MAX] = core::array::from_fn(|k| ((k * 37 % 19) as f32 - 9.0) / 9.0);
    let value = |coefficients: &[f32; COUNT_MAX], w: Vec3| -> f32 {
        coefficients.iter().zip(values(ORDER_MAX, w.to_array())).map(|(c, y)| c * y).sum()
    };
    for turn in turns {
        let turned = ShRotation::new(&turn, ORDER_MAX).apply(&coefficients);
        for w in [Vec3::Z, Vec3::new(0.48, 0.6, 0.64), Vec3::new(-0.8, 0.0, -0.6), Vec3::NEG_Y] {
            let (found, wanted) = (value(&turned, w), value(&coefficients, turn.transpose() * w));
            assert!((found - wanted).abs() < 2e-4, "{turn} {w}: {found} {wanted}");
        }
        let norm = |c: &[f32; COUNT_MAX]| c.iter().map(|c| c * c).sum::<f32>();
        assert!((norm(&turned) / norm(&coefficients) - 1.0).abs() < 1e-4);
    }
}

/// Radiance 1 above the horizon: λ_{0,0} = 2π Y, λ_{1,0} = √(3/4π) π, all with m other than 0 vanish; the
/// cosine as lobe gives the irradiance.
#[test]
fn a_uniform_sky_has_the_coefficients_of_the_integral() {
    const N: usize = 32;
    let mut lines = vec![Line([0; 64]); ShTables::footprint(N, ORDER_MAX).bytes() / 64];
    let tables =
        ShTables::build(N, ORDER_MAX, &mut Arena::new(bytemuck::cast_slice_mut(&mut lines))).unwrap();
    let sky = Sky::new(N, |_| 1.0);
    let found = ShCoefficients::project(Level::detect(), &tables, &sky.hemisphere()).unwrap();
    let light = found.values[1];
    assert!((light[0] - TAU * (0.25 / PI).sqrt()).abs() < 1e-3, "{}", light[0]);
    assert!((light[index(1, 0)] - PI * (0.75 / PI).sqrt()).abs() < 1e-3, "{}", light[2]);
    for (l, m) in (0..=8isize).flat_map(|l| (-l..=l).map(move |m| (l, m))).filter(|(_, m)| *m != 0) {
        assert!(light[index(l as usize, m)].abs() < 2e-3, "{l} {m}: {}", light[index(l as usize, m)]);
    }
    // ∫ cos Y dω above the horizon, the coefficients of the irradiance, of orders 0 to 2 and 4 (Ramamoorthi
    // and Hanrahan 2001).
    let cosine = [(0, 0.886_227), (1, 1.023_327), (2, 0.495_416), (4, -0.110_778)];
    let irradiance: f32 = cosine.iter().map(|&(l, c)| c * light[index(l, 0)]).sum();
    assert!((irradiance / PI - 1.0).abs() < 2e-3, "{irradiance}");
    assert!((found.irradiance.x / PI - 1.0).abs() < 1e-5);
    assert!(ShTables::build(0, 2, &mut Arena::new(&mut [])).is_err());
}

#[test]
fn gradients_are_differences_of_values_along_the_sphere() {
    const STEP: f32 = 1.0 / 128.0;
    for w in [Vec3::Z, Vec3::new(0.48, 0.6, 0.64), Vec3::new(-0.8, 0.0, 0.6), Vec3::NEG_Y] {
        let found = gradients(ORDER_MAX, w.to_array());
        for along in [w.any_orthonormal_vector(), w.any_orthonormal_vector().cross(w)] {
            let at = |angle: f32| values(ORDER_MAX, (angle.cos() * w + angle.sin() * along).to_array());
            let [a, b, c, d] = [STEP, -STEP, 2.0 * STEP, -2.0 * STEP].map(at);
            for (k, [x, y, z, value]) in found.into_iter().enumerate() {
                let wanted = (8.0 * (a[k] - b[k]) - (c[k] - d[k])) / (12.0 * STEP);
                let slope = Vec3::new(x, y, z).dot(along);
                assert!((slope - wanted).abs() < 2e-3 * (1.0 + wanted.abs()), "{k} {w}: {slope} {wanted}");
                assert_eq!(value, at(0.0)[k]);
                assert!(Vec3::new(x, y, z).dot(w).abs() < 1e-4);
            }
        }
    }
}

/// A disk of radiance 2 + b p_x at height 1 that fills x² + y² < 49/64 of the hemisphere. By Reynolds'
/// theorem its λ_{0,0} changes along x by b Y_{0,0} times its solid angle, less the flux through the rim.
/// Both gradients of the paper agree to the square of the step.
#[test]
fn both_gradients_of_the_paper_agree_before_a_slope_of_light() {
    const N: usize = 64;
    const STEP: f32 = 1e-2;
    const SLOPE: f32 = 0.1;
    /// A border between strata.
    const SINE: f32 = 7.0 / 8.0;
    let mut lines = vec![Line([0; 64]); ShTables::footprint(N, 4).bytes() / 64];
    let tables = ShTables::build(N, 4, &mut Arena::over(&mut lines)).unwrap();
    let sky = Sky::with_hits(N, |[x, _, z]| {
        let u = if 1.0 - z * z < SINE * SINE { z } else { 0.0 };
        (if u > 0.0 { 2.0 + SLOPE * x / z } else { 0.0 }, u, [0.0, 0.0, -1.0])
    });
    let hemisphere = sky.hemisphere();
    let analytic = unoccluded(&tables, &hemisphere).unwrap();
    let numeric = displaced(&tables, &hemisphere, STEP).unwrap();
    let light = ShCoefficients::project(Level::detect(), &tables, &hemisphere).unwrap();
    for k in 0..count(4) {
        for axis in 0..2 {
            let (a, b) = (analytic[1][k][axis], numeric[1][k][axis]);
            assert!((a - b).abs() < 2.0 * STEP * STEP * light.values[1][0], "{k}: {a} {b}");
        }
    }
    let cos = (1.0 - SINE * SINE).sqrt();
    let (solid_angle, rim) = (TAU * (1.0 - cos), PI * SINE * SINE * cos);
    let wanted = SLOPE * (0.25 / PI).sqrt() * (solid_angle - rim);
    assert!((analytic[1][0][0] / wanted - 1.0).abs() < 0.02, "{} {wanted}", analytic[1][0][0]);
    assert!(analytic[1][0][1].abs() < 1e-3);
    assert!(
        displaced(&tables, &hemisphere, 0.0).is_none() && displaced(&tables, &hemisphere, f32::NAN).is_none()
    );
    assert!(unoccluded(&tables, &Sky::new(N / 2, |_| 1.0).hemisphere()).is_none());
}
