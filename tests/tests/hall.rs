//! A hall of n² lamps: extra rays for one bright lamp and a glass ball on a table.

use glam::Vec3;
use halflight::render::Method;
use halflight_core::Rgb;
use halflight_core::scene::{Camera, Material};
use halflight_tests::render::{has_photons, render};
use halflight_tests::scenes::{SceneBuffers, emitter, glass};

const SIDE: f32 = 40.0;
const HEIGHT: f32 = 8.0;

/// Largest ratio of rays with caustic photons to rays without: emission guides and photon maps of the first
/// samples.
const MOST: f64 = 1.25;

/// `count` x `count` lamps under the ceiling, each of side 4.2 / `count`.
fn hall(count: u32) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(20.0, 2.5, 27.0), Vec3::new(20.0, 1.2, 19.0), Vec3::Y, 50.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material::diffuse(Rgb::splat(0.7)));
    let wood = buffers.material(Material::diffuse(Rgb::new(0.5, 0.3, 0.2)));
    let lamp = buffers.material(emitter(0.0, 10.0));
    let bright = buffers.material(emitter(0.0, 2000.0));
    let ball = buffers.material(Material { surface: glass(0.0), ..Material::GREY });
    buffers.cuboid(Vec3::ZERO, Vec3::new(SIDE, HEIGHT, SIDE), true, wall);
    for i in 0..count * count {
        let [x, z] = [i % count, i / count].map(|i| SIDE * (i as f32 + 0.5) / count as f32);
        buffers.square(Vec3::new(x, HEIGHT - 0.05, z), Vec3::NEG_Y, 4.2 / count as f32, lamp);
    }
    buffers.cuboid(Vec3::new(18.0, 0.9, 18.0), Vec3::new(22.0, 1.0, 21.0), false, wood);
    buffers.square(Vec3::new(21.0, 2.5, 19.5), Vec3::NEG_Y, 0.05, bright);
    buffers.normals = vec![[0.0; 3]; buffers.positions.len()];
    buffers.sphere(Vec3::new(20.0, 1.35, 19.5), 0.35, 16, ball);
    buffers
}

#[test]
fn caustics_of_a_small_ball_in_a_large_hall_take_few_rays() {
    for count in [7, 15] {
        let buffers = hall(count);
        let scene = buffers.scene();
        let rays = [true, false].map(|caustics| {
            let result = render(&scene, Method::Path, 128, 8, |settings| settings.caustics = caustics);
            assert_eq!(has_photons(&result), caustics);
            result.counters.all_rays() as f64
        });
        assert!(rays[0] < MOST * rays[1], "{count} x {count} lamps: {rays:?} rays");
    }
}
