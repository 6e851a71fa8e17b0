//! Area lights against Lambert's formula for the irradiance of a polygon, and densities against samples.

use crate::light_support::{Lamp, Stage, random_direction};
use glam::{DVec3, Vec3};
use halflight_core::geometry::Frame;
use halflight_core::sampling::{Random, Sampler, warp};

/// Standard errors that an estimate may be off: exceeded once in 15,000 by chance, if errors are normal.
const SIGMAS: f64 = 4.0;

/// Relative rounding of a single-precision estimate.
const ROUNDING: f64 = 1e-5;

/// Relative tolerance between the density of a sample and the density of the same point when hit.
const DENSITY_TOLERANCE: f32 = 1e-4;

/// Lambert 1760: irradiance at `point` by a polygon of unit radiance, all of it over the horizon.
fn lambert(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let mut sum = DVec3::ZERO;
    for (i, &a) in corners.iter().enumerate() {
        let (a, b) = ((a - point).normalize(), (corners[(i + 1) % corners.len()] - point).normalize());
        let cross = a.cross(b);
        sum += cross.normalize_or_zero() * cross.length().atan2(a.dot(b));
    }
    0.5 * sum.dot(normal).abs()
}

/// Mean and standard error of the irradiance, by `LightSampler::sample` alone.
fn irradiance(stage: &Stage, point: Vec3, normal: Vec3, samples: u32) -> (f64, f64) {
    stage.with_lights(|scene, lights| {
        let random = Random::new(1, 2);
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..samples {
            let u = [0, 1, 2].map(|d| random.single(3 * i + d));
            let value = lights.sample(scene, point, normal, u).map_or(0.0, |s| {
                f64::from(s.radiance.x) * f64::from(s.direction.dot(normal).max(0.0)) / f64::from(s.pdf)
            });
            sum += value;
            squares += value * value;
        }
        let n = f64::from(samples);
        let mean = sum / n;
        (mean, ((squares / n - mean * mean).max(0.0) / n).sqrt())
    })
}

fn check_irradiance(name: &str, lamp: &Lamp, point: Vec3, normal: Vec3) {
    let stage = Stage::of(core::slice::from_ref(lamp));
    let expected = lambert(point.as_dvec3(), normal.as_dvec3(), &lamp.outline()) * f64::from(lamp.radiance);
    let (mean, error) = irradiance(&stage, point, normal, 20_000);
    let off = (mean - expected).abs();
    assert!(off <= SIGMAS * error + ROUNDING * expected, "{name}: {mean} ± {error}, Lambert {expected}");
}

#[test]
fn irradiance_is_lamberts() {
    let quad = Lamp::quad(Vec3::new(-1.0, -1.0, 2.0), Vec3::Y * 2.0, Vec3::X * 2.0);
    let slanted = Lamp::quad(Vec3::new(-1.0, -1.0, 2.0), Vec3::Y * 2.0, Vec3::new(2.0, 1.0, 0.5));
    let triangle =
        Lamp::triangle([Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.3, 1.7, 1.2), Vec3::new(1.5, 0.2, 2.0)]);
    let strip = Lamp::quad(Vec3::new(-10.0, -0.01, 0.5), Vec3::Y * 0.02, Vec3::X * 20.0);
    for (name, lamp) in [("quad", quad), ("parallelogram", slanted), ("triangle", triangle), ("strip", strip)]
    {
        for (i, point) in
            [Vec3::ZERO, Vec3::new(3.0, 2.0, 0.4), Vec3::new(0.2, 0.1, -30.0)].into_iter().enumerate()
        {
            check_irradiance(&format!("{name} {i}"), &lamp, point, Vec3::Z);
        }
    }
}

#[test]
fn sizes_and_radiances_of_all_magnitudes() {
    for size in [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e9] {
        for radiance in [1e-20, 1.0, 1e20] {
            let corner = Vec3::new(-0.5 * size, -0.5 * size, 1.0f32.max(0.3 * size));
            let quad = Lamp { radiance, ..Lamp::quad(corner, Vec3::Y * size, Vec3::X * size) };
            let half = Lamp {
                radiance,
                ..Lamp::triangle([corner, corner + Vec3::Y * size, corner + Vec3::X * size])
            };
            check_irradiance(&format!("quad of {size}, {radiance}"), &quad, Vec3::ZERO, Vec3::Z);
            check_irradiance(&format!("triangle of {size}, {radiance}"), &half, Vec3::ZERO, Vec3::Z);
        }
    }
}

#[test]
fn sampled_densities_are_those_of_a_hit() {
    let lamps = Lamp::cloud(40, 11);
    for count in [1, 2, 3, 40] {
        let stage = Stage::of(&lamps[..count]);
        stage.with_lights(|scene, lights| {
            let mut found = 0;
            for i in 0..20_000u32 {
                let random = Random::new(3, i);
                let point = 3.0 * random_direction(&random, 0);
                let normal = if i % 3 == 0 { Vec3::ZERO } else { random_direction(&random, 2) };
                let u = [4, 5, 6].map(|d| random.single(d));
                let Some(sample) = lights.sample(scene, point, normal, u) else { continue };
                let Some((triangle, distance)) = stage.hit_near(point, sample.direction, sample.distance)
                else {
                    continue;
                };
                let pdf = lights.pdf_hit(scene, point, normal, triangle, distance, sample.direction);
                // Grazing rays magnify the rounding of the direction by 1 / cos.
                let plane = sample.target.map_or(Vec3::ZERO, |t| t.normal);
                let cos = plane.dot(sample.direction).abs();
                let tolerance = DENSITY_TOLERANCE.max(1e-6 / cos);
                let ratio = pdf / sample.pdf;
                assert!(
                    (ratio - 1.0).abs() < tolerance,
                    "{count} lamps, sample {i}: {pdf} for {}",
                    sample.pdf
                );
                found += 1;
            }
            assert!(found > 1_000, "{count} lamps: only {found} samples were compared");
        });
    }
}

#[test]
fn the_density_of_all_hits_integrates_to_the_chance_of_a_sample() {
    let stage = Stage::of(&Lamp::cloud(12, 5));
    stage.with_lights(|scene, lights| {
        for i in 0..8 {
            let random = Random::new(8, i);
            let point = 3.0 * random_direction(&random, 0);
            let normal = -point.normalize();
            let frame = Frame::from_normal(normal);
            let (mut sum, mut squares, mut sampled) = (0.0, 0.0, 0.0);
            let n = 100_000;
            for s in 0..n {
                let sampler = Sampler::new(0, i, s);
                let local = warp::cosine_hemisphere(sampler.pair(0));
                let direction = frame.to_world(local);
                // The density of every light on the way counts: a shadow ray would stop at the first.
                let value: f64 = stage
                    .all_hits(point, direction)
                    .map(|(triangle, t)| lights.pdf_hit(scene, point, normal, triangle, t, direction))
                    .map(|pdf| f64::from(pdf) / f64::from(warp::cosine_hemisphere_pdf(local.z)))
                    .sum();
                sum += value;
                squares += value * value;
                let [a, b] = sampler.pair(1);
                let found = lights.sample(scene, point, normal, [a, b, sampler.single(2)]).is_some();
                sampled += f64::from(u8::from(found));
            }
            let n = f64::from(n);
            let (mean, chance) = (sum / n, sampled / n);
            let error = ((squares / n - mean * mean) / n).sqrt() + (chance * (1.0 - chance) / n).sqrt();
            assert!((mean - chance).abs() < SIGMAS * error + 1e-4, "{mean} and {chance} ± {error}");
        }
    });
}
