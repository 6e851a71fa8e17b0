//! Spherical harmonics with known answers.

use super::*;
use crate::Level;
use crate::cache::radiance::rooms::Sky;
use crate::memory::{Arena, Line};
use core::f32::consts::TAU;
use glam::{Mat3, Vec2, Vec3};
use std::vec;

#[test]
fn functions_are_orthonormal_on_the_sphere() {
    /// Midpoints of the test's own integral, at the poles.
    const MIDPOINTS: f64 = 4e-3;
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
        let turned = ShRotation::new(&turn).apply(&coefficients);
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
    let cosine = ShLobe::project(|w| w.z).turned(Vec2::X);
    let irradiance: f32 = cosine.iter().zip(light).map(|(c, l)| c * l).sum();
    assert!((irradiance / PI - 1.0).abs() < 2e-3, "{irradiance}");
    assert!(ShTables::build(0, 2, &mut Arena::new(&mut [])).is_err());
}

/// A clipped cosine has 0.04 of its norm beyond order 2; a narrow lobe has no order up to 8.
#[test]
fn orders_follow_the_tolerance() {
    let cosine = ShLobe::project(|w| w.z);
    assert_eq!(cosine.order(0.1, ORDER_MAX), Some(2));
    assert_eq!(cosine.order(0.001, ORDER_MAX), None);
    let narrow = ShLobe::project(|w| (40.0 * (w.z - 1.0)).exp());
    assert_eq!(narrow.order(0.05, 6), None);
    assert!(narrow.order(0.5, ORDER_MAX) > cosine.order(0.5, ORDER_MAX));
    // A turned lobe turns its coefficients about z.
    let lobe = ShLobe::project(|w| w.z * (3.0 * w.x).exp());
    let (found, rotation) =
        (lobe.turned(Vec2::from_angle(0.8)), ShRotation::new(&Mat3::from_rotation_z(0.8)));
    for (found, wanted) in found.iter().zip(rotation.apply(&lobe.turned(Vec2::X))) {
        assert!((found - wanted).abs() < 1e-3, "{found} {wanted}");
    }
}
