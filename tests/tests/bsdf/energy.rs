//! Energy and reciprocity.

use super::cases::{VIEWS, coated, dielectric, draw, plastic, scattering, view};
use glam::{DVec3, Vec3};
use halflight_core::Rgb;
use halflight_core::bsdf::{All, Bsdf};
use halflight_core::sampling::Random;

const SAMPLES: u32 = 100_000;

/// Albedo per channel in white surroundings, with its standard deviation. Transmitted radiance counts as
/// power: times eta².
fn furnace(bsdf: &Bsdf, wo: Vec3, stream: u32) -> (DVec3, DVec3) {
    let random = Random::new(7, stream);
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for i in 0..SAMPLES {
        if let Some(s) = draw(bsdf, wo, &random, i) {
            let w = (s.weight * (s.eta * s.eta)).as_dvec3();
            sum += w;
            squares += w * w;
        }
    }
    let n = f64::from(SAMPLES);
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(DVec3::ZERO) / n).map(f64::sqrt))
}

/// Interpolation error of the albedo tables, zero for models without tables.
const TABLE_ERROR: f64 = 5e-3;

#[test]
fn nothing_returns_more_than_it_gets() {
    let mut white = Vec::new();
    for alpha in [0.0, 1e-3, 0.01, 0.05, 0.2, 0.5, 1.0] {
        for specular in [0.0, 0.04, 0.3, 0.9, 1.0] {
            white.push((
                format!("glossy {alpha} {specular}"),
                coated(Rgb::ONE, Rgb::splat(specular), alpha, 0.0, None),
            ));
        }
        for ior in [1.0 + 1e-6, 1.1, 1.5, 3.0, 10.0] {
            white.push((format!("plastic {alpha} {ior}"), plastic(Rgb::ONE, alpha, ior)));
        }
    }
    for (stream, (name, bsdf)) in scattering().iter().chain(&white).enumerate() {
        for cosine in VIEWS {
            let (mean, deviation) = furnace(bsdf, view(cosine), stream as u32);
            let limit = 1.0 + TABLE_ERROR + 5.0 * deviation.max_element();
            assert!(mean.max_element() <= limit, "{name} from {cosine}: returns {mean} ± {deviation}");
        }
    }
}

#[test]
fn white_surfaces_in_a_white_furnace_vanish() {
    // A white base returns all light that the coat transmits.
    for alpha in [0.0, 1e-3, 0.05, 0.2, 0.5, 1.0] {
        for specular in [0.0, 0.04, 0.5] {
            let bsdf = coated(Rgb::ONE, Rgb::splat(specular), alpha, 0.0, None);
            for cosine in VIEWS {
                let (mean, deviation) = furnace(&bsdf, view(cosine), 1);
                // The last view lies between two nodes of the table where the albedo bends most.
                let error = if cosine < 0.05 { 10.0 * TABLE_ERROR } else { 2.0 * TABLE_ERROR };
                assert!(
                    (mean.x - 1.0).abs() < error + 5.0 * deviation.x,
                    "glossy {alpha} {specular} from {cosine}: {mean} ± {deviation}"
                );
            }
        }
    }
    for (bsdf, name) in [
        (plastic(Rgb::ONE, 0.0, 1.5), "plastic 1.5"),
        (plastic(Rgb::ONE, 0.0, 1.1), "plastic 1.1"),
        (plastic(Rgb::ONE, 0.0, 3.0), "plastic 3"),
        (dielectric(1.5, Rgb::ONE, 0.0, true), "glass"),
        (dielectric(1.5, Rgb::ONE, 0.0, false), "glass from inside"),
        (dielectric(1.0, Rgb::ONE, 0.3, true), "nothing"),
    ] {
        for cosine in VIEWS {
            let (mean, deviation) = furnace(&bsdf, view(cosine), 2);
            // The polynomial fit of mean reflectance is right to 6e-4.
            assert!(
                (mean.x - 1.0).abs() < 2e-3 + 5.0 * deviation.x,
                "{name} from {cosine}: {mean} ± {deviation}"
            );
        }
    }
}

/// Relative rounding of terms that cancel at grazing angles.
const RECIPROCITY: f32 = 2e-4;

#[test]
fn light_can_be_followed_both_ways() {
    let random = Random::new(3, 3);
    for (name, bsdf) in &scattering() {
        for i in 0..500 {
            let direction = |i: u32| view(0.02 + 0.98 * random.single(i));
            let (a, b) = (direction(2 * i), direction(2 * i + 1));
            let turned = Vec3::new(b.x * 0.6 - b.y * 0.8, b.x * 0.8 + b.y * 0.6, b.z);
            let (there, back) =
                (bsdf.evaluate::<All>(a, turned).0 / turned.z, bsdf.evaluate::<All>(turned, a).0 / a.z);
            assert!(
                (there - back).abs().max_element() <= RECIPROCITY * there.max_element(),
                "{name}: {a} {turned}: {there} {back}"
            );
        }
    }
}

#[test]
fn refraction_is_symmetric_up_to_the_indices() {
    let random = Random::new(4, 4);
    for ior in [1.2, 1.5, 2.0] {
        let (outside, inside) = (dielectric(ior, Rgb::ONE, 0.3, true), dielectric(ior, Rgb::ONE, 0.3, false));
        let mut compared = 0;
        for i in 0..500 {
            let a = view(0.05 + 0.95 * random.single(2 * i));
            let b = view(0.05 + 0.95 * random.single(2 * i + 1));
            let below = Vec3::new(-b.x, -b.y, -b.z);
            // Seen from inside, the normal points the other way.
            let flip = |v: Vec3| Vec3::new(v.x, v.y, -v.z);
            let there = outside.evaluate::<All>(a, below).0.x / b.z;
            let back = inside.evaluate::<All>(flip(below), flip(a)).0.x / a.z;
            // Veach 1997, eq. 5.14: f(wi -> wo) / n_o² is symmetric.
            assert!((there - back / (ior * ior)).abs() <= 2e-3 * there, "{ior} {a} {below}: {there} {back}");
            compared += u32::from(there > 0.0);
        }
        assert!(compared > 100);
    }
}
