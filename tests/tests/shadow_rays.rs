//! Direct light of a square lamp at points of a wall, beside the integral over the lamp. A shadow ray that
//! rounding lets hit its lamp would make a point darker by a fraction that depends on the place alone.

use glam::Vec3;
use halflight::render::Method;
use halflight_core::Rgb;
use halflight_core::scene::{Camera, Material};
use halflight_tests::render::render;
use halflight_tests::scenes::{SceneBuffers, emitter};

const SIZE: u32 = 8;
const SPP: u32 = 256;

/// Middle and side of the lamp, which shines up, and distance of the wall along x.
const LAMP: Vec3 = Vec3::new(2.190_05, 1.5, 2.526_75);
const SIDE: f32 = 0.3;
const WALL: f32 = 4.130_89;

/// Irradiance of the wall at height `y` by a radiance of 1, by midpoints.
fn irradiance(y: f32) -> f64 {
    const STEPS: usize = 200;
    let (height, side) = (f64::from(y - LAMP.y), f64::from(SIDE));
    let at = |i: usize| ((i as f64 + 0.5) / STEPS as f64 - 0.5) * side;
    let of = |i: usize, j: usize| {
        let (x, z) = (f64::from(WALL - LAMP.x) - at(i), at(j));
        height * x / (x * x + height * height + z * z).powi(2)
    };
    let sum: f64 = (0..STEPS * STEPS).map(|k| of(k / STEPS, k % STEPS)).sum();
    sum * (side / STEPS as f64).powi(2)
}

#[test]
fn shadow_rays_do_not_hit_their_lamp() {
    for y in [1.6, 1.8, 2.1, 2.4, 2.6, 2.9, 3.1] {
        let point = Vec3::new(WALL, y, LAMP.z);
        let eye = Vec3::new(3.2, y, LAMP.z);
        let mut buffers = SceneBuffers::new(Camera::look_at(eye, point, Vec3::Y, 0.1));
        let wall = buffers.material(Material::diffuse(Rgb::ONE));
        let lamp = buffers.material(emitter(0.0, 1.0));
        buffers.square(Vec3::new(WALL, 1.5, LAMP.z), Vec3::NEG_X, 4.0, wall);
        buffers.square(LAMP, Vec3::Y, SIDE, lamp);
        let scene = buffers.scene();
        let result = render(&scene, Method::Path, SIZE, SPP, |settings| settings.max_depth = Some(2));
        let pixels = &result.image.pixels;
        let mean = pixels.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / pixels.len() as f64;
        let expected = irradiance(y) / core::f64::consts::PI;
        assert!((mean / expected - 1.0).abs() < 1e-3, "y = {y}: {mean} {expected}");
    }
}
