//! Pixels at the border of a lamp show the part of it that they cover, however small.

use glam::{Vec2, Vec3};
use halflight::render::Method;
use halflight_core::scene::Camera;
use halflight_tests::render::render;
use halflight_tests::scenes::{SceneBuffers, emitter};

const SIZE: u32 = 32;
const RADIANCE: f32 = 20.0;

/// Relative error of a pixel's part of the lamp is below a fourteenth: 2048 samples form two nets of 1024,
/// and between 13 and 16 points of each lie in a strip of a hundredth of the pixel.
const TOLERANCE: f32 = 0.2;

fn camera() -> Camera {
    Camera::look_at(Vec3::new(0.3, 0.2, 0.5), Vec3::new(0.1, -0.4, -3.0), Vec3::Y, 50.0)
}

/// Point of the raster on the plane at distance 1 in front of the camera.
fn through(camera: &Camera, raster: Vec2) -> Vec3 {
    let direction = Vec3::from(camera.ray(SIZE, SIZE, raster.x, raster.y, [0.5; 2]).direction);
    camera.eye + direction / direction.dot(camera.forward)
}

fn seen(scene: &SceneBuffers) -> Vec<f32> {
    let picture = render(&scene.scene(), Method::Path, SIZE, 64, |_| ());
    assert_eq!(picture.counters.dropped.total(), 0);
    picture.image.pixels.iter().map(|pixel| pixel[1] / RADIANCE).collect()
}

/// A lamp of `pieces` by `pieces` squares that extends a hundredth of a pixel beyond whole pixels on each
/// side.
fn lamp(camera: Camera, pieces: u32) -> (SceneBuffers, [Vec2; 2]) {
    let mut scene = SceneBuffers::new(camera);
    let lamp = scene.material(emitter(0.0, RADIANCE));
    let (low, high) = (Vec2::new(4.986, 9.986), Vec2::new(21.014, 12.014));
    let at = |x: u32, y: u32| {
        let share = Vec2::new(x as f32, y as f32) / pieces as f32;
        through(&camera, low + share * (high - low))
    };
    for (x, y) in (0..pieces * pieces).map(|piece| (piece % pieces, piece / pieces)) {
        scene.quad([at(x, y + 1), at(x + 1, y + 1), at(x + 1, y), at(x, y)], lamp);
    }
    (scene, [low, high])
}

#[test]
fn an_audit_sees_borders_as_the_picture_does() {
    let (scene, _) = lamp(camera(), 1);
    // With an error target the work of the audit is counted in rays, so it is the same in each run.
    let picture = render(&scene.scene(), Method::Path, SIZE, 256, |settings| {
        settings.stop.error = Some(1e-9);
        settings.audit = Some(0.5);
    });
    let bias = picture.audit.expect("an audit").bias;
    // 0.3 with paths of the samples alone, which hit the border once in seventy times.
    assert!(bias.detectable < 0.01, "{bias:?}");
}

#[test]
fn a_hundredth_of_a_pixel_is_seen_by_every_pixel() {
    let camera = camera();
    // Lamps of 2 and of 1250 triangles.
    for pieces in [1, 25] {
        let (scene, [low, high]) = lamp(camera, pieces);
        for (i, seen) in seen(&scene).into_iter().enumerate() {
            let pixel = Vec2::new((i as u32 % SIZE) as f32, (i as u32 / SIZE) as f32);
            let inside = (high.min(pixel + 1.0) - low.max(pixel)).max(Vec2::ZERO);
            let share = inside.x * inside.y;
            // Corner pixels show a ten-thousandth.
            if share < 0.001 {
                assert!(seen < 0.003, "{pixel}: {seen} of {share}");
            } else {
                assert!((seen / share - 1.0).abs() < TOLERANCE, "{pixel}: {seen} of {share}");
            }
        }
    }
}

#[test]
fn a_lamp_that_begins_behind_the_camera_has_a_border() {
    let camera = Camera::look_at(Vec3::Y, Vec3::new(0.0, 0.2, -3.0), Vec3::Y, 60.0);
    let mut scene = SceneBuffers::new(camera);
    let lamp = scene.material(emitter(0.0, RADIANCE));
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    scene.quad([corner(-0.8, 5.0), corner(0.9, 5.0), corner(0.9, -7.0), corner(-0.8, -7.0)], lamp);

    const SUB: u32 = 64;
    for (i, seen) in seen(&scene).into_iter().enumerate() {
        let (x, y) = (i as u32 % SIZE, i as u32 / SIZE);
        let is_met = |k: u32| {
            let at = |k: u32| (k as f32 + 0.5) / SUB as f32;
            let ray = camera.ray(SIZE, SIZE, x as f32 + at(k % SUB), y as f32 + at(k / SUB), [0.5; 2]);
            let point = ray.at(-ray.origin[1] / ray.direction[1]);
            ray.direction[1] < 0.0 && (-0.8..0.9).contains(&point.x) && point.z > -7.0
        };
        let share = (0..SUB * SUB).filter(|k| is_met(*k)).count() as f32 / (SUB * SUB) as f32;
        assert!((seen - share).abs() < 0.01, "{x} {y}: {seen} of {share}");
    }
}
