//! Stiff inputs: every roughness, index and angle that a file can hold, at the corners of the unit cube of
//! random numbers.

use super::cases::{coated, conductor, dielectric, empty_scene, resolve};
use glam::{Vec2, Vec3};
use halflight_core::Rgb;
use halflight_core::bsdf::{All, Bsdf};
use halflight_core::sampling::ONE_MINUS_EPSILON;
use halflight_core::scene::{ScalarInput, Surface};

const COSINES: [f32; 9] = [1.0, 1.0 - 1e-7, 0.9, 0.5, 1e-2, 1e-3, 1e-6, 1e-12, 1e-30];
const UNITS: [f32; 6] = [0.0, 1e-9, 0.25, 0.5, 0.999, ONE_MINUS_EPSILON];
const ALPHAS: [f32; 10] = [0.0, 1e-9, 0.99e-4, 1e-4, 1.01e-4, 1e-3, 1e-2, 0.3, 1.0, 5.0];
const INDICES: [f32; 14] = [
    1.0,
    1.0 + 1e-6,
    1.0 - 1e-6,
    1.0 + 1e-3,
    1.0 - 1e-3,
    1.33,
    1.5,
    10.0,
    0.1,
    1e9,
    1e-9,
    0.0,
    f32::NAN,
    f32::INFINITY,
];
/// Rounding of a weight whose exact value is 1.
const ROUNDING: f32 = 1e-4;

fn everything() -> Vec<(String, Bsdf)> {
    let mut all = Vec::new();
    for alpha in ALPHAS {
        for f0 in [0.0, 0.04, 1.0, -1.0, 7.0, f32::NAN] {
            let color = Rgb::new(f0, 0.5, 1.0);
            all.push((format!("conductor {alpha} {f0}"), conductor(color, alpha)));
            for metallic in [0.0, 0.3, 1.0, f32::NAN] {
                let name = format!("glossy {alpha} {f0} {metallic}");
                all.push((name, coated(Rgb::ONE, color, alpha, metallic, None)));
            }
        }
        for ior in INDICES {
            for metallic in [0.0, 0.3] {
                let name = format!("plastic {alpha} {ior} {metallic}");
                all.push((name, coated(Rgb::ONE, Rgb::splat(0.04), alpha, metallic, Some(ior))));
            }
            for front in [true, false] {
                let tint = Rgb::new(0.0, 1.0, 3.0);
                all.push((format!("glass {alpha} {ior} {front}"), dielectric(ior, tint, alpha, front)));
            }
        }
    }
    for reflectance in [Rgb::splat(f32::NAN), Rgb::splat(-1.0), Rgb::splat(1e30)] {
        all.push((
            format!("diffuse {reflectance}"),
            resolve(Surface::Diffuse { reflectance: reflectance.into() }, true),
        ));
        all.push((
            format!("mirror {reflectance}"),
            resolve(Surface::Mirror { reflectance: reflectance.into() }, true),
        ));
    }
    for roughness in [f32::NAN, f32::INFINITY, -0.5] {
        let roughness: ScalarInput = roughness.into();
        let surface = Surface::Conductor { reflectance: Rgb::ONE.into(), roughness };
        all.push(("wild roughness".to_string(), resolve(surface, true)));
    }
    all
}

/// Largest weight of a sample. Models of one lobe weigh at most 1. With two lobes, samples of one may carry
/// the energy of the other; and the coat is sampled twice as often as its energy requires, which doubles the
/// weight of rare samples of the base.
const GREATEST_WEIGHT: f32 = 8.0;

#[test]
fn no_input_makes_a_number_that_is_none() {
    let mut greatest = (0.0, String::new());
    for (name, bsdf) in everything() {
        for cosine in COSINES {
            let sin = (1.0 - f64::from(cosine) * f64::from(cosine)).sqrt() as f32;
            for wo in [Vec3::new(sin, 0.0, cosine), Vec3::new(-0.6 * sin, 0.8 * sin, cosine)] {
                for u in UNITS.iter().flat_map(|&a| UNITS.iter().flat_map(move |&b| UNITS.map(|c| [a, b, c])))
                {
                    let Some(s) = bsdf.sample::<All>(wo, u) else { continue };
                    let at = || format!("{name}, cosine {cosine}, u {u:?}: {s:?}");
                    assert!(
                        s.direction.is_finite() && (s.direction.length() - 1.0).abs() < ROUNDING,
                        "{}",
                        at()
                    );
                    assert!(s.pdf.is_finite() && s.pdf > 0.0, "{}", at());
                    assert!(s.weight.is_finite() && s.weight.min_element() >= 0.0, "{}", at());
                    assert!(s.transmitted == (s.direction.z < 0.0) && s.direction.z != 0.0, "{}", at());
                    let weight = (s.weight * (s.eta * s.eta)).max_element();
                    if weight > greatest.0 {
                        greatest = (weight, at());
                    }
                    for wi in
                        [s.direction, Vec3::new(-wo.x, -wo.y, wo.z), -wo, wo, Vec3::X, Vec3::Z, Vec3::NEG_Z]
                    {
                        let (value, pdf) = bsdf.evaluate::<All>(wo, wi);
                        assert!(value.is_finite() && value.min_element() >= 0.0, "{} at {wi}: {value}", at());
                        assert!(pdf.is_finite() && pdf >= 0.0, "{} at {wi}: {pdf}", at());
                    }
                }
            }
        }
    }
    assert!(greatest.0 < GREATEST_WEIGHT, "{greatest:?}");
}

#[test]
fn textures_out_of_place_do_no_harm() {
    use halflight_core::scene::{Attributes, ColorInput, TextureId};
    let scene = empty_scene();
    let missing = ColorInput { texture: Some(TextureId(77)), ..Rgb::splat(0.25).into() };
    assert_eq!(missing.at::<All>(&scene, &Attributes::of_uv(Vec2::splat(f32::NAN))), Rgb::splat(0.25));
    let scalar = ScalarInput { texture: Some((TextureId(3), 200)), ..0.5.into() };
    assert_eq!(scalar.at::<All>(&scene, &Attributes::NONE), 0.5);
}
