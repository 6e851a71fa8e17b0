//! Radiance of lobes, and its gradient, against known light and brute force.

use super::lobe::ReflectedRadiance;
use super::*;
use crate::Rgb;
use crate::bsdf::{Bsdf, Conductor};
use crate::cache::irradiance::{Record, SECTORS};
use crate::geometry::Bounds;
use crate::memory::{Arena, Line};
use crate::sampling::Random;
use glam::{Vec2, Vec3};
use std::vec;
use std::vec::Vec;

fn metal(alpha: f32) -> Bsdf {
    Bsdf::Conductor(Conductor { f0: Rgb::new(0.9, 0.6, 0.3), alpha })
}

/// Reflected radiance at `place` of the plane z = 0, whose light along a ray from there is `light`: radiance
/// and inverse distance. One sample in the middle of each of n × n strata, or one at random.
fn reflected(
    bsdf: &Bsdf,
    (place, eye): (Vec3, Vec3),
    (n, random): (usize, Option<u32>),
    light: &dyn Fn(Vec3, Vec3) -> (f32, f32),
) -> ReflectedRadiance {
    let to_eye = eye - place;
    let lobe = ViewedLobe::new(bsdf, to_eye.normalize(), to_eye.length()).unwrap();
    let points: Vec<[f32; 2]> = (0..n * n)
        .map(|stratum| {
            let offset = |axis: u32| match random {
                Some(seed) => Random::new(seed, stratum as u32).single(axis),
                None => 0.5,
            };
            [((stratum / n) as f32 + offset(0)) / n as f32, ((stratum % n) as f32 + offset(1)) / n as f32]
        })
        .collect();
    let seen: Vec<_> = points.iter().map(|&u| light(place, lobe.direction(u))).collect();
    let radiance: Vec<_> = seen.iter().map(|(radiance, _)| [*radiance; 3]).collect();
    let inverse_distance: Vec<_> = seen.iter().map(|(_, inverse)| *inverse).collect();
    lobe.reflected(LobeSamples {
        n,
        points: &points,
        radiance: &radiance,
        inverse_distance: &inverse_distance,
    })
    .unwrap()
}

/// Radiance reflected at `place`, by 256 × 256 directions of the lobe.
fn exact(bsdf: &Bsdf, place: Vec3, eye: Vec3, light: &dyn Fn(Vec3, Vec3) -> (f32, f32)) -> f64 {
    const N: usize = 256;
    let to_eye = eye - place;
    let lobe = ViewedLobe::new(bsdf, to_eye.normalize(), to_eye.length()).unwrap();
    let mut sum = 0.0;
    for stratum in 0..N * N {
        let u = [stratum / N, stratum % N].map(|k| (k as f32 + 0.5) / N as f32);
        let direction = lobe.direction(u);
        if direction.z > 0.0 {
            let (radiance, _) = light(place, direction);
            sum += f64::from(radiance * lobe.weight_of(direction).x);
        }
    }
    sum / (N * N) as f64
}

fn difference(of: &dyn Fn(Vec3) -> f64, place: Vec3, step: f32) -> Vec2 {
    let along = |axis: Vec3| (of(place + step * axis) - of(place - step * axis)) as f32 / (2.0 * step);
    Vec2::new(along(Vec3::X), along(Vec3::Y))
}

const EYE: Vec3 = Vec3::new(-1.2, 0.2, 1.0);

/// Light of one radiance everywhere is reflected by the albedo of the lobe, over the reflectance of the
/// mirror direction, and has the gradient of that albedo.
#[test]
fn light_of_one_radiance_has_the_gradient_of_the_albedo() {
    let light = |_: Vec3, _: Vec3| (1.0, 0.7);
    for alpha in [0.05, 0.1, 0.2] {
        let bsdf = metal(alpha);
        for place in [Vec3::ZERO, Vec3::new(0.7, -0.3, 0.0), Vec3::new(2.0, 0.5, 0.0)] {
            let found = reflected(&bsdf, (place, EYE), (32, None), &light).derivatives;
            let albedo = |place: Vec3| exact(&bsdf, place, EYE, &light);
            let wanted = albedo(place);
            assert!((f64::from(found.irradiance.x) / wanted - 1.0).abs() < 5e-3, "{alpha} {place}");
            let slope = difference(&albedo, place, 0.02);
            // The albedo changes over about the height of the camera.
            assert!(
                found.gradient[0].distance(slope) < 0.01,
                "{alpha} {place}: {} {slope}",
                found.gradient[0]
            );
            assert_eq!(found.hessian.xx, 0.0);
        }
    }
}

/// A wall at x = 1 of squares of two radiances, `squares` for each unit of length, over a dark floor.
fn checkered(squares: f32) -> impl Fn(Vec3, Vec3) -> (f32, f32) {
    move |place, direction| {
        let t = (1.0 - place.x) / direction.x;
        let at = place + t * direction;
        let square = |x: f32| libm::floorf(squares * x + 0.3) as i32;
        let radiance = if (square(at.y) + square(at.z)) % 2 == 0 { 1.0 } else { 0.25 };
        if t > 0.0 { (radiance, 1.0 / t) } else { (0.2, 0.0) }
    }
}

#[test]
fn gradients_of_a_checkered_wall_are_those_of_brute_force() {
    let mut all = Vec::new();
    for alpha in [0.1, 0.2] {
        // The lobe is about as wide as a square.
        let (bsdf, light) = (metal(alpha), checkered(0.1 / alpha));
        let (mut errors, mut size) = (0.0, 0.0);
        for i in 0..12u32 {
            let random = Random::new(9, i);
            let place = Vec3::new(0.8 * random.single(0) - 0.4, random.single(1) - 0.5, 0.0);
            let wanted = difference(&|place| exact(&bsdf, place, EYE, &light), place, 0.02);
            let found = reflected(&bsdf, (place, EYE), (32, None), &light).derivatives.gradient[0];
            errors += found.distance_squared(wanted);
            size += wanted.length_squared();
        }
        all.push(libm::sqrtf(errors / size));
    }
    assert!(all.iter().all(|error| *error < 0.05), "{all:?}");
}

/// Radii of two records at a distance of 0.1, the second of another radiance and with half the radius. They
/// are compared if an error is `allowed`.
fn radii_beside(kinds: [LobeKind; 2], normal: Vec3, allowed: f32) -> [f32; 2] {
    let bounds = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
    let mut lines = vec![Line([0; 64]); ViewRecords::footprint(2).bytes() / 64];
    let mut records = ViewRecords::new(&bounds, 2, &mut Arena::over(&mut lines)).unwrap();
    for (i, kind) in kinds.into_iter().enumerate() {
        let radius = [0.4, 0.2][i];
        let record = Record {
            position: [[0.4, 0.5, 0.5], [0.5, 0.5, 0.5]][i],
            normal: [Vec3::Z, normal][i].to_array(),
            axis: [1.0, 0.0, 0.0],
            irradiance: [[1.0; 3], [1.5; 3]][i],
            radii: [radius; 2],
            overlap: 1.0,
            reach: radius,
            boundary: [u8::MAX; SECTORS],
            free: [u8::MAX; SECTORS],
            allowed,
            ..Record::default()
        };
        assert!(records.insert(record, kind));
    }
    [0, 1].map(|i: usize| records.records()[i].radii[0])
}

#[test]
fn only_records_that_serve_the_same_points_correct_each_other() {
    let [varnish, metal] = [0, 1].map(|material| LobeKind { material, alpha: 0.1 });
    let corrected = radii_beside([metal; 2], Vec3::Z, 1e-4);
    assert!(corrected[0] < 0.2 && corrected[1] < 0.2, "{corrected:?}");
    assert_eq!(radii_beside([metal, LobeKind { alpha: 0.105, ..metal }], Vec3::Z, 1e-4), corrected);
    let clamped = radii_beside([metal; 2], Vec3::Z, 0.0);
    assert!((clamped[0] - 0.3).abs() < 1e-6 && clamped[1] == 0.2, "{clamped:?}");
    let tilted = Vec3::new(0.0, 0.05, 1.0).normalize();
    for (kinds, normal) in [
        ([metal, varnish], Vec3::Z),
        ([metal, LobeKind { alpha: 0.15, ..metal }], Vec3::Z),
        ([metal; 2], tilted),
    ] {
        for allowed in [0.0, 1e-4] {
            assert_eq!(radii_beside(kinds, normal, allowed), [0.4, 0.2], "{kinds:?} {normal}");
        }
    }
}
