//! BSDFs against values of Mitsuba, Fresnel and Snell.

use super::cases::{coated, conductor, dielectric, plastic, resolve, view};
use glam::Vec3;
use halflight_core::Rgb;
use halflight_core::bsdf::{All, Bsdf, DiffuseOnly};
use halflight_core::scene::Surface;

/// Base of Mitsuba 3.9.1's `plastic` (alpha 0) and `roughplastic` (GGX), `nonlinear`, without the specular
/// part: alpha, index, albedo, and f cos θ_i for (cos θ_o, cos θ_i) = (1, 0.8), (0.5, 0.5), (0.2, 0.7).
const MITSUBA: [(f32, f32, f32, [f32; 3]); 11] = [
    (0.0, 1.5, 0.5, [0.074032, 0.041820, 0.044282]),
    (0.0, 1.5, 1.0, [0.257647, 0.145542, 0.154110]),
    (0.0, 1.3, 0.8, [0.180372, 0.104806, 0.114018]),
    (0.0, 2.4, 0.3, [0.012304, 0.007002, 0.007786]),
    (0.05, 1.5, 0.5, [0.072902, 0.041075, 0.044922]),
    (0.1, 1.5, 0.8, [0.148361, 0.083262, 0.095944]),
    (0.15, 1.5, 1.0, [0.215385, 0.120412, 0.145157]),
    (0.3, 1.3, 0.5, [0.082316, 0.045586, 0.057608]),
    (0.3, 1.9, 0.9, [0.105649, 0.058055, 0.074687]),
    (0.6, 1.5, 0.5, [0.053749, 0.026165, 0.031588]),
    (1.0, 1.5, 0.7, [0.061300, 0.022898, 0.025550]),
];
/// Relative tolerance: both programs interpolate tables, and Mitsuba fits the mean Fresnel reflectance.
const AGREEMENT: f32 = 1e-2;

#[test]
fn the_base_of_plastics_agrees_with_mitsuba() {
    for (alpha, ior, albedo, expected) in MITSUBA {
        // A coat of reflectance 0 leaves the base alone.
        let bsdf = coated(Rgb::splat(albedo), Rgb::ZERO, alpha, 0.0, Some(ior));
        for ((o, i), expected) in [(1.0, 0.8), (0.5, 0.5), (0.2, 0.7)].into_iter().zip(expected) {
            let value = bsdf.evaluate::<All>(view(o), view(i)).0.x;
            assert!(
                (value / expected - 1.0).abs() < AGREEMENT,
                "alpha {alpha} ior {ior} albedo {albedo} from {o} to {i}: {value}, Mitsuba {expected}"
            );
        }
    }
}

#[test]
fn the_smooth_coat_is_a_mirror_over_its_base() {
    let wo = view(0.6);
    let bsdf = plastic(Rgb::splat(0.5), 0.0, 1.5);
    let coat = bsdf.sample::<All>(wo, [0.5, 0.5, 0.0]).expect("the coat reflects");
    assert!(coat.delta && coat.direction == Vec3::new(-wo.x, -wo.y, wo.z));
    // Weight times probability is the Fresnel reflectance: 0.064525 at cos 0.6 for index 1.5.
    assert!((coat.weight.x * coat.pdf - 0.064_525).abs() < 1e-6, "{coat:?}");
    assert!(!bsdf.is_delta() && plastic(Rgb::ZERO, 0.0, 1.5).is_delta());
    // The density at the mirror direction is that of the base: a delta lobe has none.
    assert!(bsdf.evaluate::<All>(wo, coat.direction).1 < 1.0);
}

#[test]
fn delta_lobes() {
    let wo = view(0.6);
    let mirror = resolve(Surface::Mirror { reflectance: Rgb::splat(0.9).into() }, true);
    for bsdf in [mirror, conductor(Rgb::ONE, 0.0), dielectric(1.5, Rgb::ONE, 0.0, true)] {
        assert!(bsdf.is_delta());
        assert_eq!(bsdf.evaluate::<All>(wo, Vec3::new(-wo.x, -wo.y, wo.z)), (Rgb::ZERO, 0.0));
        let s = bsdf.sample::<All>(wo, [0.3, 0.6, 0.0]).expect("reflects");
        assert!(s.delta && !s.transmitted && s.eta == 1.0);
    }
    let s = dielectric(1.5, Rgb::ONE, 0.0, true).sample::<All>(wo, [0.3, 0.6, 0.99]).expect("refracts");
    // Snell: sin θ_t = sin θ / 1.5. Radiance is divided by eta² on the way out of the denser medium.
    assert!(s.transmitted && (s.direction.truncate().length() - 0.8 / 1.5).abs() < 1e-6);
    assert!((s.weight.x - 1.0 / 2.25).abs() < 1e-6 && s.eta == 1.5);
    let s = dielectric(1.5, Rgb::ONE, 0.0, false).sample::<All>(wo, [0.3, 0.6, 0.99]).expect("reflects");
    assert!(!s.transmitted && s.pdf == 1.0 && s.weight == Rgb::ONE, "total reflection: {s:?}");
}

#[test]
fn an_index_of_one_is_not_there() {
    for alpha in [0.0, 0.5] {
        for cosine in [1.0, 0.3, 1e-6] {
            let wo = view(cosine);
            let s = dielectric(1.0, Rgb::new(0.5, 1.0, 1.0), alpha, true).sample::<All>(wo, [0.1, 0.2, 0.0]);
            let s = s.expect("passes");
            assert_eq!((s.direction, s.weight, s.pdf), (-wo, Rgb::new(0.5, 1.0, 1.0), 1.0));
        }
    }
}

#[test]
fn a_glossy_surface_without_gloss_is_diffuse() {
    let plain = coated(Rgb::splat(0.4), Rgb::ZERO, 0.3, 0.0, None);
    assert!(matches!(plain, Bsdf::Diffuse(d) if d.reflectance == Rgb::splat(0.4)));
    let metal = coated(Rgb::splat(0.4), Rgb::splat(0.04), 0.3, 1.0, None);
    let conductor = conductor(Rgb::splat(0.4), 0.3);
    let (wo, wi) = (view(0.7), Vec3::new(0.0, 0.6, 0.8));
    let (a, b) = (metal.evaluate::<All>(wo, wi), conductor.evaluate::<All>(wo, wi));
    assert!((a.0 - b.0).abs().max_element() < 1e-6 && (a.1 - b.1).abs() < 1e-5 * b.1, "{a:?} {b:?}");
}

#[test]
fn absent_features_leave_diffuse_as_it_is() {
    let diffuse = resolve(Surface::Diffuse { reflectance: Rgb::splat(0.7).into() }, true);
    let (wo, u) = (view(0.5), [0.2, 0.7, 0.9]);
    assert_eq!(diffuse.sample::<All>(wo, u), diffuse.sample::<DiffuseOnly>(wo, u));
}
