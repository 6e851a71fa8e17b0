//! Light that comes to a floor by a mirror and is seen by the mirror again. The only technique that joins its
//! paths is a hit of the lamp; the answer is that of the picture behind the mirror.

use core::f32::consts::PI;
use glam::Vec3;
use halflight::render::Method;
use halflight_core::Rgb;
use halflight_core::scene::{Camera, Material};
use halflight_tests::render::render;
use halflight_tests::scenes::{SceneBuffers, emitter, metal};

const SIZE: u32 = 32;
const SEEDS: u32 = 2;

const SIDE_OF_LAMP: f32 = 0.06;
const RADIANCE: f32 = 100.0;
const ALBEDO: f32 = 0.7;

/// That of [`metal`] of roughness 0 at all angles here, within a hundredth.
const MIRROR: f32 = 0.9;

/// Relative error of a mean: four deviations of that of paths, of which one in a thousand meets the lamp.
const NEAR: f32 = 0.25;

/// The lamp in front of the mirror at x = 0, to which it turns.
const LAMP: Vec3 = Vec3::new(0.4, 0.5, 0.0);
const EYE: Vec3 = Vec3::new(2.0, 0.6, 0.0);
const FLOOR: Vec3 = Vec3::new(1.0, 0.0, 0.0);

/// The same place behind the mirror.
fn mirrored(place: Vec3) -> Vec3 {
    place * Vec3::new(-1.0, 1.0, 1.0)
}

fn camera(eye: Vec3) -> Camera {
    Camera::look_at(eye, mirrored(FLOOR), Vec3::Y, 3.0)
}

fn scene() -> SceneBuffers {
    let mut buffers = SceneBuffers::new(camera(EYE));
    let floor = buffers.material(Material::diffuse(Rgb::splat(ALBEDO)));
    let mirror = buffers.material(Material { surface: metal(0.0), ..Material::GREY });
    let lamp = buffers.material(emitter(0.0, RADIANCE));
    buffers.square(FLOOR, Vec3::Y, 1.0, floor);
    buffers.square(Vec3::ZERO, Vec3::X, 4.0, mirror);
    buffers.square(LAMP, Vec3::NEG_X, SIDE_OF_LAMP, lamp);
    buffers
}

/// Mean radiance of the picture: the floor in the light of the lamp behind the mirror.
fn expected() -> f32 {
    let camera = camera(EYE);
    let at = |pixel: u32| (pixel % SIZE, pixel / SIZE);
    let radiance = |pixel: u32| {
        let (x, y) = at(pixel);
        let ray = camera.ray(SIZE, SIZE, x as f32 + 0.5, y as f32 + 0.5, [0.5; 2]);
        let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
        let place = mirrored(origin - direction * (origin.y / direction.y));
        let to_lamp = mirrored(LAMP) - place;
        let unit = to_lamp.normalize();
        let solid_angle = SIDE_OF_LAMP * SIDE_OF_LAMP * -unit.x / to_lamp.length_squared();
        MIRROR * MIRROR * ALBEDO / PI * RADIANCE * solid_angle * unit.y
    };
    (0..SIZE * SIZE).map(radiance).sum::<f32>() / (SIZE * SIZE) as f32
}

#[test]
fn light_by_mirrors_at_both_ends_has_its_mean() {
    let (buffers, expected) = (scene(), expected());
    // Samples of photons have a thousand light paths.
    for (method, spp) in [
        (Method::Path, 256),
        (Method::ProgressivePhotons, 8),
        (Method::LightTracing, 256),
        (Method::Bidirectional, 256),
        (Method::VertexMerging, 32),
        (Method::InstantRadiosity, 256),
        (Method::Metropolis, 256),
    ] {
        for seed in 0..SEEDS {
            let result = render(&buffers.scene(), method, SIZE, spp, |settings| {
                (settings.seed, settings.max_depth) = (seed, Some(4));
            });
            let sum = result.image.pixels.iter().map(|pixel| pixel[1]).sum::<f32>();
            let mean = sum / (SIZE * SIZE) as f32;
            let off = mean / expected - 1.0;
            assert!(off.abs() < NEAR, "{} seed {seed}: {mean} {expected}", method.name());
        }
    }
}
