//! Direct light of a square lamp at points of a wall, beside the integral over the lamp. A shadow ray that
//! rounding lets hit its lamp would make a point darker by a fraction that depends on the place alone.

use crate::load_support::Files;
use core::cell::Cell;
use glam::Vec3;
use halflight::render::Method;
use halflight_core::Rgb;
use halflight_core::sampling::Random;
use halflight_core::scene::{Camera, Material};
use halflight_tests::render::render;
use halflight_tests::scenes::{SceneBuffers, emitter};

const SIZE: u32 = 8;
const SPP: u32 = 256;

/// Middle and side of the lamp, which shines up, and distance of the wall along x.
const LAMP: Vec3 = Vec3::new(2.190_05, 1.5, 2.526_75);
const SIDE: f32 = 0.3;
const WALL: f32 = 4.130_89;

/// Irradiance of a wall at distance `x` along x and height `y` above the middle of a lamp of this side, by a
/// radiance of 1 and midpoints.
fn irradiance(x: f32, y: f32, side: f32) -> f64 {
    const STEPS: usize = 200;
    let (distance, height, side) = (f64::from(x), f64::from(y), f64::from(side));
    let at = |i: usize| ((i as f64 + 0.5) / STEPS as f64 - 0.5) * side;
    let of = |i: usize, j: usize| {
        let (x, z) = (distance - at(i), at(j));
        height * x / (x * x + height * height + z * z).powi(2)
    };
    let sum: f64 = (0..STEPS * STEPS).map(|k| of(k / STEPS, k % STEPS)).sum();
    sum * (side / STEPS as f64).powi(2)
}

/// Asserts that the mean of `pixels` is the light of `expected` on a white wall.
fn assert_light(name: &str, pixels: &[[f32; 3]], expected: f64) {
    let mean = pixels.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / pixels.len() as f64;
    let expected = expected / core::f64::consts::PI;
    assert!((mean / expected - 1.0).abs() < 2e-3, "{name}: {mean} {expected}");
}

/// The loader moves the coordinates of a file, so that those of the lamp are rounded.
#[test]
fn shadow_rays_do_not_hit_the_lamp_of_a_file() {
    for y in [1.6, 1.8, 2.1, 2.4, 2.6, 2.9, 3.1] {
        let [x, z] = [LAMP.x, LAMP.z];
        let [low, high] = [-SIDE / 2.0, SIDE / 2.0];
        let corner = |dx: f32, dz: f32| format!("v {} {} {}\n", x + dx, LAMP.y, z + dz);
        let lamp = [corner(low, low), corner(low, high), corner(high, high), corner(high, low)].concat();
        let wall = format!(
            "v {WALL} 0 {}\nv {WALL} 0 {}\nv {WALL} 3.4 {}\nv {WALL} 3.4 {}\n",
            z - 2.0,
            z + 2.0,
            z + 2.0,
            z - 2.0
        );
        let obj = format!("mtllib m.mtl\nusemtl lamp\n{lamp}f 1 2 3 4\nusemtl wall\n{wall}f 5 6 7 8\n");
        let toml = format!(
            "[[mesh]]\nfile = \"q.obj\"\n[camera]\neye = [3.2, {y}, {z}]\nlook_at = [{WALL}, {y}, {z}]\nfov = 0.1\n"
        );
        let mtl = b"newmtl lamp\nKd 0 0 0\nKe 1 1 1\nnewmtl wall\nKd 1 1 1\n";
        let files = [("q.obj", obj.as_bytes()), ("m.mtl", mtl.as_slice()), ("s.toml", toml.as_bytes())];
        let loaded = Files::new(&files).load("s.toml").unwrap();
        let views = loaded.views();
        let scene = views.scene(loaded.camera_or_default());
        let result = render(&scene, Method::Path, SIZE, SPP, |settings| settings.max_depth = Some(2));
        assert_light(&format!("y = {y}"), &result.image.pixels, irradiance(WALL - LAMP.x, y - LAMP.y, SIDE));
    }
}

#[test]
fn shadow_rays_do_not_hit_lamps_at_random_places() {
    for index in 0..60 {
        let random = Random::new(7, index);
        let draw = Cell::new(0);
        let between = |low: f32, high: f32| {
            draw.set(draw.get() + 1);
            low + (high - low) * random.single(draw.get())
        };
        let lamp = Vec3::new(between(-5.0, 5.0), between(-5.0, 5.0), between(-5.0, 5.0));
        let (side, distance) = (between(0.1, 0.5), between(0.5, 3.0));
        let height = between(0.1, 2.0);
        let point = lamp + Vec3::new(distance, height, 0.0);
        let mut buffers = SceneBuffers::new(Camera::look_at(point - Vec3::X * 0.2, point, Vec3::Y, 0.1));
        let white = buffers.material(Material::diffuse(Rgb::ONE));
        let light = buffers.material(emitter(0.0, 1.0));
        buffers.square(point, Vec3::NEG_X, 1.0, white);
        buffers.square(lamp, Vec3::Y, side, light);
        let scene = buffers.scene();
        let result = render(&scene, Method::Path, SIZE, SPP, |settings| settings.max_depth = Some(2));
        assert_light(&format!("place {index}"), &result.image.pixels, irradiance(distance, height, side));
    }
}

/// Lamps above each other, of which a floor sees the lowest alone. In a wide scene the offset point before a
/// lamp is further from it than the next lamp.
#[test]
fn lamps_behind_a_lamp_add_no_light() {
    for (gap, extent) in [(1e-4, 2.0), (4e-6, 2.0), (1e-4, 300.0), (1e-3, 3000.0)] {
        for method in [Method::Path, Method::Bidirectional, Method::Metropolis] {
            let [one, stack] = [1, 8].map(|count| {
                let mut buffers =
                    SceneBuffers::new(Camera::look_at(Vec3::new(0.0, 1.5, 2.0), Vec3::ZERO, Vec3::Y, 30.0));
                let floor = buffers.material(Material::diffuse(Rgb::splat(0.6)));
                let lamp = buffers.material(emitter(0.0, 12.0));
                buffers.square(Vec3::ZERO, Vec3::Y, 2.0 * extent, floor);
                for number in 0..count {
                    buffers.square(Vec3::Y * (2.0 + gap * number as f32), Vec3::NEG_Y, 1.0, lamp);
                }
                let result =
                    render(&buffers.scene(), method, 16, 256, |settings| settings.max_depth = Some(2));
                let pixels = result.image.pixels;
                pixels.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / pixels.len() as f64
            });
            assert!((stack / one - 1.0).abs() < 0.02, "{method:?}, {gap} in {extent}: {stack} {one}");
        }
    }
}
