//! Images of lamps in mirrors and through glass are as bright as they should be, however small, in every picture.

use glam::{Vec2, Vec3};
use halflight::drive::{Method, RenderResult, Settings};
use halflight_core::scene::{Camera, Material, Surface};
use halflight_tests::render::render;
use halflight_tests::scenes::{SceneBuffers, emitter, glass, metal};

const SIZE: u32 = 32;
const RADIANCE: f32 = 1000.0;

fn picture(scene: &SceneBuffers, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    let result = render(&scene.scene(), Method::Path, SIZE, spp, change);
    assert_eq!(result.counters.dropped.total(), 0);
    result
}

/// The light of a picture, in lamps that fill a pixel.
fn light(result: &RenderResult) -> f64 {
    result.image.pixels.iter().map(|pixel| f64::from(pixel[1] / RADIANCE)).sum()
}

/// A ball of radius 1 with a lamp of a side of `size` behind the camera, and nothing else.
fn ball(surface: Surface, size: f32) -> SceneBuffers {
    let mut scene = SceneBuffers::new(Camera::look_at(Vec3::new(0.0, 0.5, 5.0), Vec3::ZERO, Vec3::Y, 30.0));
    let lamp = scene.material(emitter(0.0, RADIANCE));
    let material = scene.material(Material { surface, ..Material::GREY });
    let place = Vec3::new(1.2, 3.0, 4.0);
    scene.square(place, -place.normalize(), size, lamp);
    scene.normals = vec![[0.0; 3]; scene.positions.len()];
    scene.sphere(Vec3::ZERO, 1.0, 24, material);
    scene
}

/// The same, where nobody looks for images: through a lens they are not sharp.
fn without_images(mut scene: SceneBuffers) -> SceneBuffers {
    scene.camera.lens_radius = 1e-6;
    scene.camera.focus_distance = 4.0;
    scene
}

#[test]
fn a_mirror_shows_a_thousandth_of_a_pixel_of_lamp() {
    let camera = Camera::look_at(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, Vec3::Y, 40.0);
    let mut scene = SceneBuffers::new(camera);
    let lamp = scene.material(emitter(0.0, RADIANCE));
    let surface = Surface::Mirror { reflectance: Vec3::ONE.into() };
    let mirror = scene.material(Material { surface, ..Material::GREY });
    scene.square(Vec3::ZERO, Vec3::Z, 2.0, mirror);
    let (center, size) = (Vec3::new(0.23, 0.31, 5.0), 0.008);
    scene.square(center, Vec3::NEG_Z, size, lamp);
    // As large as the lamp would be at the place that the mirror shows it at.
    let on_raster = |by: Vec2| {
        let point = Vec3::new(center.x + by.x * size, center.y + by.y * size, -center.z);
        camera.project(SIZE, SIZE, point, [0.0; 2]).unwrap().raster
    };
    let half = 0.5;
    let sides = on_raster(Vec2::splat(half)) - on_raster(Vec2::splat(-half));
    let area = f64::from((sides.x * sides.y).abs());
    assert!(area < 2e-3, "{area}");
    for seed in 0..4 {
        let result = picture(&scene, 16, |settings| settings.seed = seed);
        assert!((1..4).contains(&result.images), "{}", result.images);
        let share = light(&result) / area;
        assert!((share - 1.0).abs() < 0.1, "{share} of {area}");
    }
    // Camera, mirror, lamp: two segments.
    assert!(light(&picture(&scene, 16, |settings| settings.max_depth = Some(2))) > 0.5 * area);
    assert_eq!(light(&picture(&scene, 16, |settings| settings.max_depth = Some(1))), 0.0);
}

#[test]
fn a_ball_shows_as_much_light_with_images_as_without() {
    for (surface, size) in [(glass(0.0), 0.3), (metal(0.0), 0.3), (glass(0.0), 0.8)] {
        let scene = ball(surface, size);
        let (mut sum, mut squares, seeds) = (0.0, 0.0, 8);
        for seed in 0..seeds {
            let result = picture(&scene, 16, |settings| settings.seed = seed);
            assert!(result.images > 0);
            let light = light(&result);
            (sum, squares) = (sum + light, squares + light * light);
        }
        let mean = sum / f64::from(seeds);
        let scatter = (squares / f64::from(seeds) - mean * mean).max(0.0).sqrt();
        let scene = without_images(scene);
        let (mut sum, mut squares) = (0.0, 0.0);
        for seed in 0..seeds {
            let result = picture(&scene, 1024, |settings| settings.seed = 100 + seed);
            assert_eq!(result.images, 0);
            let light = light(&result);
            (sum, squares) = (sum + light, squares + light * light);
        }
        let plain = sum / f64::from(seeds);
        let noise = (squares / f64::from(seeds) - plain * plain).max(0.0).sqrt();
        let n = f64::from(seeds);
        println!("{mean} +- {scatter} of 16 samples, {plain} +- {noise} of 1024 without");
        // Four standard errors, of so few seeds.
        let error = (scatter * scatter + noise * noise).sqrt() / (n - 1.0).sqrt();
        assert!((mean - plain).abs() < 4.0 * error, "{mean} {plain} {error}");
        assert!(error < 0.1 * plain, "{error} {plain}: this tells nothing");
        // By chance, the noise of 16 samples is eight times that of 1024 at least.
        assert!(scatter < 4.0 * noise, "{scatter} {noise}");
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let scene = ball(glass(0.0), 0.1);
    let [one, three] = [1, 3].map(|threads| picture(&scene, 4, |settings| settings.threads = Some(threads)));
    assert!(one.image == three.image && one.images == three.images);
}

#[test]
fn nobody_looks_where_nothing_mirrors() {
    let scene = halflight_tests::scenes::cornell_box();
    assert_eq!(render(&scene.scene(), Method::Path, SIZE, 1, |_| ()).images, 0);
}
