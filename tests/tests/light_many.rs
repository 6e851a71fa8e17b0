//! 300,000 lights: exact memory, low variance and low cost of the light tree.

use crate::light_support::{Lamp, Stage, random_direction};
use glam::Vec3;
use halflight_core::sampling::Random;
use std::time::Instant;

/// Emissive triangles in the shell of a sphere.
const LAMPS: u32 = 300_000;

fn galaxy() -> Stage {
    let lamp = |i| {
        let random = Random::new(4, i);
        let center = random_direction(&random, 0) * (1.0 + random.single(6));
        let u = random_direction(&random, 2) * 1e-3;
        let v = random_direction(&random, 4) * 1e-3;
        Lamp { radiance: 1.0 + random.single(7), ..Lamp::triangle([center, center + u, center + v]) }
    };
    Stage::of(&(0..LAMPS).map(lamp).collect::<Vec<_>>())
}

#[test]
fn one_of_very_many_is_found_quickly_and_well() {
    let stage = galaxy();
    let start = Instant::now();
    stage.with_lights(|scene, lights| {
        println!("built in {:.3} s", start.elapsed().as_secs_f64());
        let (point, normal) = (Vec3::new(0.2, 0.1, 0.0), Vec3::Z);
        // Light tree against the exact irradiance, summed over all lights as points of their intensity.
        let of_lamp = |triangle| {
            let [a, b, c] = scene.mesh.corners(triangle);
            let (to_light, area_normal) = ((a + b + c) / 3.0 - point, 0.5 * (b - a).cross(c - a));
            let (distance2, front) = (to_light.length_squared(), -area_normal.dot(to_light));
            let radiance = f64::from(scene.materials[triangle as usize].emission.value.x);
            radiance * f64::from(front.max(0.0) * normal.dot(to_light).max(0.0) / (distance2 * distance2))
        };
        let exact: f64 = (0..LAMPS).map(of_lamp).sum();
        // Relative deviation of one sample with equal probabilities for all lamps.
        let squares: f64 = (0..LAMPS).map(of_lamp).map(|e| e * e).sum();
        let even = (f64::from(LAMPS) * squares / (exact * exact) - 1.0).sqrt();
        let n = 1 << 16;
        let start = Instant::now();
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..n {
            let random = Random::new(6, i);
            let value =
                lights.sample(scene, point, normal, [0, 1, 2].map(|d| random.single(d))).map_or(0.0, |s| {
                    f64::from(s.radiance.x) * f64::from(s.direction.dot(normal).max(0.0)) / f64::from(s.pdf)
                });
            sum += value;
            squares += value * value;
        }
        println!("{:.0} ns a sample", start.elapsed().as_secs_f64() * 1e9 / f64::from(n));
        let (mean, n) = (sum / f64::from(n), f64::from(n));
        let deviation = (squares / n - mean * mean).sqrt();
        let deviation = deviation / mean;
        println!(
            "irradiance {mean} by samples, {exact} by sum; deviation {deviation:.2}, even chances {even:.2}"
        );
        assert!((mean / exact - 1.0).abs() < 4.0 * deviation / n.sqrt() + 1e-4, "{mean} for {exact}");
        assert!(deviation < 0.8 * even, "relative deviation {deviation}, by even chances {even}");
    });
}

#[test]
fn identical_lamps_and_lamps_in_one_place_can_be_told_apart() {
    // No plane separates the lamps: the build halves them by count.
    let lamp = Lamp::triangle([Vec3::ZERO, Vec3::X, Vec3::Y]);
    let stage = Stage::of(&vec![lamp; 1000]);
    stage.with_lights(|scene, lights| {
        let (point, direction) = (Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
        let pdf = |triangle| lights.pdf_hit(scene, point, direction, triangle, 1.0, direction);
        let (first, sum) = (pdf(0), (0..1000).map(pdf).sum::<f32>());
        assert!(first > 0.0 && (sum / (1000.0 * first) - 1.0).abs() < 0.3, "{first} of {sum}");
    });
}
