//! Derivatives of coefficients in environments with known answers.

use super::*;
use crate::Level;
use crate::cache::irradiance::CellFlux;
use crate::cache::radiance::zernike::{DEGREE_MAX, count, gradients, values};
use crate::cache::skies::{Sky, with_strata};
use crate::memory::{Arena, Line};
use std::vec;

/// Six walls of a unit room seen from (0.3, 0.4) on its floor: radiance by wall, inverse distance, normal.
fn room(w: [f32; 3], walls: [f32; 5]) -> (f32, f32, [f32; 3]) {
    let (x, y) = (0.3, 0.4);
    let inverse = |d: f32, low: f32| if d < 0.0 { -d / low } else { d / (1.0 - low) };
    let [a, b, c] = [inverse(w[0], x), inverse(w[1], y), w[2]];
    if a > b.max(c) {
        (walls[usize::from(w[0] > 0.0)], a, [-w[0].signum(), 0.0, 0.0])
    } else if b > c {
        (walls[2 + usize::from(w[1] > 0.0)], b, [0.0, -w[1].signum(), 0.0])
    } else {
        (walls[4], c, [0.0, 0.0, -1.0])
    }
}

const WALLS: [f32; 5] = [1.0, 0.2, 0.5, 0.8, 0.3];

#[test]
fn one_radiance_and_a_sky_at_infinity_have_no_derivatives() {
    with_strata(16, DEGREE_MAX, |tables| {
        let walls = Sky::with_hits(16, |w| room(w, [0.7; 5]));
        let sky = Sky::new(16, |w| 1.0 + w[0] - 0.5 * w[2]);
        for sky in [walls, sky] {
            let found = border_flux(Level::detect(), tables, &sky.hemisphere()).unwrap();
            assert_eq!(found.gradients, [[[0.0; 2]; COUNT_MAX]; 3]);
            assert_eq!(found.hessians, [Hessian::default(); COUNT_MAX]);
        }
    });
}

#[test]
fn degree_zero_is_the_derivative_of_the_irradiance() {
    const N: usize = 32;
    /// `CellFlux` has four great circles for a border.
    const CIRCLES: f32 = 3e-3;
    let mut lines = vec![Line([0; 64]); CellFlux::footprint(N).bytes() / 64];
    let cells = CellFlux::build(N, &mut Arena::over(&mut lines)).unwrap();
    let sky = Sky::with_hits(N, |w| room(w, WALLS));
    let irradiance = cells.derivatives(Level::detect(), &sky.hemisphere()).unwrap();
    with_strata(N, 4, |tables| {
        let found = border_flux(Level::detect(), tables, &sky.hemisphere()).unwrap();
        let root = core::f32::consts::PI.sqrt();
        for (found, wanted) in found.gradients.iter().zip(irradiance.gradient) {
            let gradient = root * Vec2::from(found[0]);
            assert!((gradient - wanted).length() < CIRCLES * wanted.length(), "{gradient} {wanted}");
        }
        let (found, wanted) = (found.hessians[0] * root, irradiance.hessian);
        let off = (found.xx - wanted.xx).abs() + (found.xy - wanted.xy).abs() + (found.yy - wanted.yy).abs();
        assert!(off < CIRCLES * (wanted.xx.abs() + wanted.yy.abs()), "{found:?} {wanted:?}");
    });
}

/// B_k by neighbouring degrees equals 4 Z_k q - ∇Z_k + q (q·∇Z_k).
#[test]
fn second_derivatives_are_the_printed_kernel() {
    for q in [[0.1f32, 0.2], [-0.7, 0.3], [0.2, -0.9]] {
        for normal in [[1.0f32, 0.0], [0.0, 1.0], [0.6, -0.8]] {
            let higher = crate::cache::radiance::zernike::values_higher(DEGREE_MAX + 1, q);
            let mut found = [Hessian::default(); COUNT_MAX];
            border_flux::hessians(DEGREE_MAX, |k| normal.map(|n| n * higher[k]), &mut found);
            let functions = values(DEGREE_MAX, q).into_iter().zip(gradients(DEGREE_MAX, q));
            for (k, (value, slope)) in functions.enumerate() {
                let (q, slope, normal) = (Vec2::from(q), Vec2::from(slope), Vec2::from(normal));
                let b = 4.0 * value * q - slope + q * q.dot(slope);
                let wanted = [normal.x * b.x, 0.5 * (normal.x * b.y + normal.y * b.x), normal.y * b.y];
                for (found, wanted) in [found[k].xx, found[k].xy, found[k].yy].into_iter().zip(wanted) {
                    assert!((found - wanted).abs() < 2e-4, "{k} at {q}: {found} {wanted}");
                }
            }
        }
    }
}

/// All lengths times 1024: gradients over 1024, Hessians over 1024², to the bit.
#[test]
fn derivatives_scale_with_lengths() {
    let near = Sky::with_hits(24, |w| room(w, WALLS));
    let far = Sky::with_hits(24, |w| {
        let (light, inverse, normal) = room(w, WALLS);
        (light, inverse / 1024.0, normal)
    });
    with_strata(24, 6, |tables| {
        let near = border_flux(Level::detect(), tables, &near.hemisphere()).unwrap();
        let far = border_flux(Level::BASELINE, tables, &far.hemisphere()).unwrap();
        for k in 0..count(6) {
            assert_eq!(near.gradients[1][k].map(|x| x / 1024.0), far.gradients[1][k]);
            assert_eq!(near.hessians[k] * (1.0 / 1024.0 / 1024.0), far.hessians[k]);
        }
    });
}

/// Both gradients without occlusion agree to second order in the step, and with the borders in a room without
/// occluders.
#[test]
fn gradients_without_occlusion_agree() {
    let sky = Sky::with_hits(64, |w| room(w, WALLS));
    with_strata(64, 6, |tables| {
        let hemisphere = sky.hemisphere();
        let flux = border_flux(Level::detect(), tables, &hemisphere).unwrap().gradients;
        let analytic = unoccluded(tables, &hemisphere).unwrap();
        let numeric = [1e-2, 5e-3].map(|step| displaced(tables, &hemisphere, step).unwrap());
        let size = |a: &Gradients, b: &Gradients| {
            let pairs = a[0].as_flattened().iter().zip(b[0].as_flattened());
            pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
        };
        let whole = size(&analytic, &[[[0.0; 2]; COUNT_MAX]; 3]);
        let [coarse, fine] = numeric.map(|numeric| size(&numeric, &analytic) / whole);
        assert!(coarse < 2e-2 && fine < 0.4 * coarse, "{coarse} {fine}");
        assert!(size(&flux, &analytic) < 0.06 * whole, "{}", size(&flux, &analytic) / whole);
        assert!(displaced(tables, &hemisphere, 0.0).is_none());
    });
}
