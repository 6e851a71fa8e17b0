//! Lights of every kind together: environments by chi-squared, lights without surface, probabilities of
//! kinds, emission with textures, and exact memory.

use crate::light_support::{Lamp, Stage, random_direction};
use glam::{Mat3, Vec2, Vec3};
use halflight_core::Rgb;
use halflight_core::light::{LightSampler, emitted};
use halflight_core::memory::Arena;
use halflight_core::sampling::{Random, Sampler, warp};
use halflight_core::scene::{Attributes, DistantDisc, Environment, PointLight, Scene};
use halflight_core::scene::{Texels, Texture, TextureId, TextureTransform, Wrap};
use halflight_tests::memory::TestArena;

/// Standard errors that an estimate may be off.
const SIGMAS: f64 = 4.0;

/// A small dark sky with a sun a thousand times brighter, away from the poles.
static SKY: [[f32; 3]; 16 * 8] = {
    let mut texels = [[0.1, 0.2, 0.3]; 16 * 8];
    texels[2 * 16 + 5] = [300.0, 280.0, 200.0];
    texels[16 + 15] = [3.0, 2.0, 2.0];
    texels
};

fn sky() -> Stage {
    let map = Texture {
        width: 16,
        height: 8,
        texels: Texels::Float(&SKY),
        wrap: Wrap::REPEAT,
        transform: TextureTransform::IDENTITY,
        second_set: false,
    };
    let to_map = Mat3::from_cols(Vec3::new(0.0, 0.0, 1.0), Vec3::X, Vec3::Y);
    Stage {
        environment: Some(Environment {
            radiance: Rgb::splat(0.5),
            map: Some(TextureId(0)),
            to_map,
            disc: None,
        }),
        textures: vec![map],
        ..Stage::default()
    }
}

/// The sky with the disc of a sun, and a constant sky with one, which is wide enough for random directions.
fn with_discs() -> [Stage; 2] {
    let direction = Vec3::new(0.3, -0.4, 0.6).normalize();
    let disc = DistantDisc::of_irradiance(direction, 0.1, Rgb::new(3.0, 2.0, 1.0));
    let mut stages = [sky(), sky()];
    for stage in &mut stages {
        let environment = stage.environment.as_mut().expect("a sky");
        environment.disc = Some(disc);
    }
    if let Some(environment) = &mut stages[1].environment {
        environment.map = None;
    }
    stages
}

#[test]
fn a_disc_gives_the_irradiance_that_is_asked_for() {
    let mut stage = with_discs().into_iter().last().expect("two");
    if let Some(environment) = &mut stage.environment {
        environment.radiance = Rgb::ZERO;
    }
    stage.with_lights(|scene, lights| {
        let disc = scene.environment.and_then(|sky| sky.disc).expect("a disc");
        let (n, mut sum) = (1 << 12, 0.0f64);
        for i in 0..n {
            let sampler = Sampler::new(4, 0, i);
            let [a, b] = sampler.pair(0);
            let sample = lights.sample(scene, Vec3::ZERO, disc.direction, [a, b, sampler.single(1)]);
            let cos = |direction: Vec3| f64::from(direction.dot(disc.direction));
            sum += sample.map_or(0.0, |s| f64::from(s.radiance.x) * cos(s.direction) / f64::from(s.pdf));
        }
        // Nearly all samples hit the disc.
        assert!((sum / f64::from(n) - 3.0).abs() < 0.01, "{}", sum / f64::from(n));
    });
}

#[test]
fn the_sky_has_its_sun_where_the_convention_says() {
    let stage = sky();
    let scene = stage.scene();
    let environment = scene.environment.expect("set above");
    // Texel (5, 2): phi = 2 pi 5.5 / 16, theta = pi 2.5 / 8.
    let (phi, theta) = (core::f32::consts::TAU * 5.5 / 16.0, core::f32::consts::PI * 2.5 / 8.0);
    let on_map = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
    let radiance = environment.radiance(&scene, environment.to_map.transpose() * on_map);
    assert!((radiance / Rgb::new(150.0, 140.0, 100.0) - Rgb::ONE).abs().max_element() < 1e-4, "{radiance}");
    // The poles have the value of the adjacent row.
    let pole = environment.radiance(&scene, environment.to_map.transpose() * Vec3::NEG_Y);
    assert!(pole.distance(Rgb::new(0.05, 0.1, 0.15)) < 1e-4, "{pole}");
}

#[test]
fn environment_samples_have_the_density_that_is_stated() {
    // Estimates ∫ dω over each of 8 × 16 cells of directions by weights 1 / pdf; a z-test each.
    let [disc, constant] = with_discs();
    for stage in [sky(), disc, constant] {
        stage.with_lights(samples_have_their_density);
    }
}

fn samples_have_their_density(scene: &Scene, lights: &LightSampler) {
    let n = 1 << 18;
    let mut cells = vec![[0.0f64; 2]; 128];
    let mut edges = 0;
    for i in 0..n {
        let random = Random::new(2, i);
        let u = [0, 1, 2].map(|d| random.single(d));
        // Samples of the map behind a disc are rejected.
        let Some(sample) = lights.sample(scene, Vec3::ZERO, Vec3::ZERO, u) else {
            let disc = scene.environment.and_then(|sky| sky.disc);
            assert!(disc.is_some(), "the sky is all around");
            continue;
        };
        let pdf = lights.pdf_escape(scene, Vec3::ZERO, Vec3::ZERO, sample.direction);
        assert!(sample.distance == f32::INFINITY && !sample.delta);
        // At the edge of two texels rounding may move the direction to the other one.
        edges += u32::from((pdf / sample.pdf - 1.0).abs() > 1e-4);
        let d = sample.direction;
        let ring = ((0.5 * d.z + 0.5) * 8.0).min(7.0) as usize;
        let slice = ((d.y.atan2(d.x) / core::f32::consts::TAU + 0.5) * 16.0).min(15.0) as usize;
        let weight = 1.0 / f64::from(sample.pdf);
        cells[ring * 16 + slice][0] += weight;
        cells[ring * 16 + slice][1] += weight * weight;
    }
    assert!(edges <= n >> 14, "{edges} of {n} samples have another density when looked up");
    let n = f64::from(n);
    let exact = 4.0 * core::f64::consts::PI / 128.0;
    for [sum, squares] in cells {
        let mean = sum / n;
        let sigma = ((squares / n - mean * mean) / n).sqrt();
        assert!((mean - exact).abs() < SIGMAS * sigma, "{mean} ± {sigma} for {exact}");
    }
}

#[test]
fn environment_irradiance_is_that_of_uniform_directions() {
    let constant = Stage {
        environment: Some(Environment {
            radiance: Rgb::splat(2.0),
            map: None,
            to_map: Mat3::IDENTITY,
            disc: None,
        }),
        ..Stage::default()
    };
    let [disc, constant_disc] = with_discs();
    let discs = [("disc", disc), ("constant with a disc", constant_disc)];
    for (name, stage) in [("sky", sky()), ("constant", constant)].into_iter().chain(discs) {
        stage.with_lights(|scene, lights| {
            let environment = scene.environment.expect("both have one");
            let normal = Vec3::new(0.6, 0.0, 0.8);
            let n = 1 << 18;
            let (mut sums, mut squares) = ([0.0f64; 2], [0.0f64; 2]);
            for i in 0..n {
                let sampler = Sampler::new(1, 0, i);
                let [a, b] = sampler.pair(0);
                let by_light =
                    lights.sample(scene, Vec3::ZERO, normal, [a, b, sampler.single(1)]).map_or(0.0, |s| {
                        f64::from(s.radiance.x) * f64::from(s.direction.dot(normal).max(0.0))
                            / f64::from(s.pdf)
                    });
                let d = warp::uniform_sphere(sampler.pair(2));
                let radiance = f64::from(environment.radiance(scene, d).x);
                let by_chance = radiance * f64::from(d.dot(normal).max(0.0)) * 4.0 * core::f64::consts::PI;
                for (i, value) in [by_light, by_chance].into_iter().enumerate() {
                    sums[i] += value;
                    squares[i] += value * value;
                }
            }
            let n = f64::from(n);
            let mean = sums.map(|s| s / n);
            let variance = [0, 1].map(|i| (squares[i] / n - mean[i] * mean[i]).max(0.0) / n);
            let error = (variance[0] + variance[1]).sqrt();
            assert!(
                (mean[0] - mean[1]).abs() < SIGMAS * error + 1e-4 * mean[1],
                "{name}: {mean:?} ± {error}"
            );
            assert!(variance[0] < 0.2 * variance[1], "{name}: sampling the light must pay: {variance:?}");
        });
    }
}

#[test]
fn lights_without_surface_have_their_intensity() {
    let at = Vec3::new(0.0, 3.0, 4.0);
    let point = PointLight::Point { position: at, intensity: Rgb::new(50.0, 25.0, 5.0) };
    let spot = PointLight::Spot {
        position: at,
        direction: Vec3::NEG_Y,
        intensity: Rgb::splat(50.0),
        cos_inner: 0.9,
        cos_outer: 0.5,
    };
    let sun = PointLight::Directional { direction: Vec3::NEG_Y, irradiance: Rgb::splat(3.0) };
    let seen = |light: PointLight| {
        let stage = Stage { lights: vec![light], ..Stage::default() };
        stage.with_lights(|scene, lights| lights.sample(scene, Vec3::ZERO, Vec3::Y, [0.3, 0.4, 0.5]))
    };
    let of_point = seen(point).expect("nothing is in its way");
    assert!(of_point.delta && of_point.pdf == 1.0 && of_point.target.is_none());
    assert!((of_point.distance - 5.0).abs() < 1e-6 && of_point.direction.distance(at / 5.0) < 1e-6);
    assert!(of_point.radiance.distance(Rgb::new(2.0, 1.0, 0.2)) < 1e-6);
    // Linear in the angle between the outer and the inner cone.
    let fade = (0.5f32.acos() - 0.6f32.acos()) / (0.5f32.acos() - 0.9f32.acos());
    let of_spot = seen(spot).expect("within the cone");
    assert!((of_spot.radiance.x - 2.0 * fade).abs() < 1e-5, "{}", of_spot.radiance);
    let of_sun = seen(sun).expect("above");
    assert!(of_sun.delta && of_sun.direction == Vec3::Y && of_sun.radiance.x == 3.0 && of_sun.pdf == 1.0);
    assert!(of_sun.distance == f32::INFINITY);
}

#[test]
fn all_kinds_together_bring_the_sum_of_their_irradiances() {
    let mut stage = Stage { lights: Vec::new(), ..sky() };
    for lamp in Lamp::cloud(20, 3) {
        stage.add(&lamp);
    }
    stage.lights = vec![
        PointLight::Point { position: Vec3::new(0.0, 0.0, 0.5), intensity: Rgb::splat(2.0) },
        PointLight::Directional { direction: Vec3::new(0.6, 0.0, 0.8), irradiance: Rgb::splat(1.0) },
        PointLight::Directional { direction: Vec3::new(0.0, -0.6, 0.8), irradiance: Rgb::splat(4.0) },
        PointLight::Point { position: Vec3::new(0.0, 2.0, -0.5), intensity: Rgb::splat(f32::NAN) },
        PointLight::Spot {
            position: Vec3::new(0.5, 0.0, -1.0),
            direction: Vec3::NEG_Z,
            intensity: Rgb::splat(3.0),
            cos_inner: 0.9,
            cos_outer: 0.8,
        },
    ];
    let (point, normal) = (Vec3::new(0.3, 0.1, -2.5), Vec3::Z);
    let irradiance = |stage: &Stage| {
        stage.with_lights(|scene, lights| {
            let n = 1 << 18;
            let (mut sum, mut squares) = (0.0, 0.0);
            for i in 0..n {
                let random = Random::new(5, i);
                let u = [0, 1, 2].map(|d| random.single(d));
                let value = lights.sample(scene, point, normal, u).map_or(0.0, |s| {
                    f64::from(s.radiance.x) * f64::from(s.direction.dot(normal).max(0.0)) / f64::from(s.pdf)
                });
                sum += value;
                squares += value * value;
            }
            let n = f64::from(n);
            (sum / n, (squares / n - (sum / n).powi(2)) / n)
        })
    };
    let whole = irradiance(&stage);
    let mut parts = (0.0, 0.0);
    let none = |stage: &Stage| Stage { materials: stage.materials.clone(), ..Stage::default() };
    let mut only = vec![sky(), Stage::of(&Lamp::cloud(20, 3))];
    only.extend(stage.lights.iter().map(|&light| Stage { lights: vec![light], ..none(&stage) }));
    for part in &only {
        let (mean, variance) = irradiance(part);
        parts = (parts.0 + mean, parts.1 + variance);
    }
    let error = (whole.1 + parts.1).sqrt();
    assert!((whole.0 - parts.0).abs() < SIGMAS * error + 1e-4 * parts.0, "{whole:?} and {parts:?} ± {error}");
}

#[test]
fn lamps_shine_to_their_front_only_unless_two_sided() {
    let lamp = Lamp::quad(Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0);
    for two_sided in [false, true] {
        let stage = Stage::of(&[Lamp { two_sided, ..lamp.clone() }]);
        stage.with_lights(|scene, lights| {
            let seen = |from: Vec3| lights.sample(scene, from, Vec3::ZERO, [0.5; 3]);
            assert!(seen(Vec3::Z).is_some_and(|s| s.target.is_some_and(|t| t.normal == Vec3::Z)));
            assert_eq!(seen(Vec3::NEG_Z).is_some(), two_sided);
            let back = lights.pdf_hit(scene, Vec3::NEG_Z, Vec3::ZERO, 0, 1.0, Vec3::Z);
            assert_eq!(back > 0.0, two_sided);
            assert_eq!(emitted(scene, 0, &Attributes::NONE, false) == Rgb::ZERO, !two_sided);
            assert_eq!(emitted(scene, 1, &Attributes::NONE, true), Rgb::ONE);
            assert_eq!(emitted(scene, 7, &Attributes::NONE, true), Rgb::ZERO);
        });
    }
}

#[test]
fn a_textured_lamp_sends_what_its_texels_say() {
    static CHECKER: [[f32; 3]; 4] = [[1.0; 3], [0.0; 3], [0.0; 3], [1.0; 3]];
    let mut stage = Stage::of(&[Lamp::quad(Vec3::new(-1.0, -1.0, 1.0), Vec3::Y * 2.0, Vec3::X * 2.0)]);
    stage.textures = vec![Texture {
        width: 2,
        height: 2,
        texels: Texels::Float(&CHECKER),
        wrap: Wrap::CLAMP,
        transform: TextureTransform::IDENTITY,
        second_set: false,
    }];
    stage.materials[0].emission.texture = Some(TextureId(0));
    stage.texcoords = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    stage.with_lights(|scene, lights| {
        for i in 0..1000 {
            let sampler = Sampler::new(0, 0, i);
            let [a, b] = sampler.pair(0);
            let Some(sample) = lights.sample(scene, Vec3::ZERO, Vec3::Z, [a, b, 0.5]) else { continue };
            let at = sample.target.expect("an area light").position;
            let uv = Vec2::new(0.5 * at.y + 0.5, 0.5 * at.x + 0.5);
            let expected = stage.textures[0].lookup(uv)[0];
            assert!((sample.radiance.x - expected).abs() < 1e-4, "at {at}: {}", sample.radiance);
        }
    });
}

#[test]
fn one_byte_less_is_an_error_and_nothing_needs_nothing() {
    let mut stage = sky();
    for lamp in Lamp::cloud(33, 1) {
        stage.add(&lamp);
    }
    stage.lights = vec![
        PointLight::Point { position: Vec3::ZERO, intensity: Rgb::ONE },
        PointLight::Directional { direction: Vec3::X, irradiance: Rgb::ONE },
    ];
    let scene = stage.scene();
    let footprint = LightSampler::footprint(&scene).and(LightSampler::scratch(&scene));
    let mut memory = TestArena::new(footprint);
    let (memory, bytes) = (memory.bytes(), footprint.bytes());
    assert!(LightSampler::build(&scene, &mut Arena::new(&mut memory[..bytes - 1])).is_err());
    assert!(LightSampler::build(&scene, &mut Arena::new(memory)).is_ok());

    let nothing = Stage::default();
    assert_eq!(
        LightSampler::footprint(&nothing.scene()).and(LightSampler::scratch(&nothing.scene())).bytes(),
        0
    );
    nothing.with_lights(|scene, lights| {
        assert!(lights.is_empty() && lights.sample(scene, Vec3::ZERO, Vec3::Z, [0.5; 3]).is_none());
        assert_eq!(lights.pdf_hit(scene, Vec3::ZERO, Vec3::Z, 0, 1.0, Vec3::Z), 0.0);
        assert_eq!(lights.pdf_escape(scene, Vec3::ZERO, Vec3::Z, Vec3::Z), 0.0);
    });
}

#[test]
fn broken_lamps_and_points_are_survived() {
    let mut lamps = Lamp::cloud(6, 9);
    lamps.push(Lamp::triangle([Vec3::ZERO; 3]));
    lamps.push(Lamp::triangle([Vec3::ZERO, Vec3::X, Vec3::splat(f32::NAN)]));
    lamps.push(Lamp::triangle([Vec3::ZERO, Vec3::X, Vec3::splat(f32::INFINITY)]));
    lamps.push(Lamp { radiance: f32::INFINITY, ..lamps[0].clone() });
    lamps.push(Lamp { radiance: f32::NAN, ..lamps[0].clone() });
    let stage = Stage::of(&lamps);
    stage.with_lights(|scene, lights| {
        for i in 0..1000 {
            let random = Random::new(1, i);
            let mut point = random_direction(&random, 0);
            let broken = [f32::NAN, f32::INFINITY, 1e38, 0.0, 1e-38][i as usize % 5];
            point[i as usize % 3] = broken;
            let u = [2, 3, 4].map(|d| random.single(d));
            if let Some(sample) = lights.sample(scene, point, Vec3::ZERO, u) {
                assert!(sample.pdf > 0.0 && sample.pdf.is_finite() && sample.direction.is_finite());
            }
            for triangle in 0..stage.triangles.len() as u32 {
                let pdf = lights.pdf_hit(scene, point, Vec3::Y, triangle, 1.0, Vec3::Y);
                assert!(!pdf.is_nan());
            }
        }
    });
}
