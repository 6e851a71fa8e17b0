//! Orthographic cameras and panoramas: silhouettes, environments, and agreement of the methods.

use crate::picture::{SIZE, assert_picture, render};
use core::f64::consts::{PI, TAU};
use glam::{DVec3, Mat3, Vec3};
use halflight::render::Method;
use halflight_core::Rgb;
use halflight_core::scene::{Camera, Environment, Texels, Texture, TextureId, TextureTransform, Wrap};
use halflight_tests::render::{blocks, render as render_square};
use halflight_tests::scenes::{SceneBuffers, cornell_box, emitter};
use halflight_tests::statistics::agree;

/// Parallel rays along −z, with pixels of a tenth.
fn parallel() -> Camera {
    Camera::look_at(Vec3::new(0.1, -0.2, 5.0), Vec3::new(0.1, -0.2, 0.0), Vec3::Y, 40.0).orthographic(1.2)
}

#[test]
fn an_orthographic_silhouette_is_as_large_as_its_square_at_any_distance() {
    // A square of 0.5, whose edges cut pixels 3 and 8 in half.
    let covered = |i: u32| match i {
        3 | 8 => 0.5,
        4..=7 => 1.0,
        _ => 0.0,
    };
    for depth in [4.9, 1.0, -30.0] {
        let mut scene = SceneBuffers::new(parallel());
        let lamp = scene.material(emitter(0.0, 3.0));
        let corner = |x: f32, y: f32| Vec3::new(0.1 + 0.25 * x, -0.2 + 0.25 * y, depth);
        scene.quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], lamp);
        assert_picture(&scene, |_| (), |x, y| 3.0 * covered(x) * covered(y));
    }
}

#[test]
fn a_wide_lens_blurs_an_orthographic_picture_before_its_plane_of_focus_alone() {
    let mut scene = SceneBuffers::new(Camera { lens_radius: 0.2, focus_distance: 4.0, ..parallel() });
    let lamp = scene.material(emitter(0.0, 1.0));
    scene.square(Vec3::new(0.1, -0.2, 1.0), Vec3::Z, 0.4, lamp);
    let sharp = render(&scene, 1, |_| ());
    let is_inside = |i: usize| [i % 12, i / 12].iter().all(|at| (4..8).contains(at));
    assert!((0..144).all(|i| (sharp[i] - f64::from(u8::from(is_inside(i)))).abs() < 1e-5), "{sharp:?}");
    scene.camera.focus_distance = 2.0;
    let blurred = render(&scene, 1, |_| ());
    let sum = |pixels: &[f64]| pixels.iter().sum::<f64>();
    assert!(blurred.iter().filter(|light| **light > 0.0).count() > 40, "{blurred:?}");
    // Parallel bundles keep the light of the square.
    assert!((sum(&blurred) / sum(&sharp) - 1.0).abs() < 0.01, "{} {}", sum(&blurred), sum(&sharp));
}

/// A smooth map, whose texels are its values at their centres.
fn value(phi: f64, theta: f64) -> f64 {
    2.0 + theta.cos() + theta.sin() * (phi.cos() + 0.5 * (2.0 * phi).sin())
}

#[test]
fn a_panorama_of_an_environment_is_its_map() {
    const WIDTH: u32 = 256;
    const HEIGHT: u32 = 256;
    let texels: Vec<[f32; 3]> = (0..WIDTH * HEIGHT)
        .map(|i| {
            let phi = TAU * (f64::from(i % WIDTH) + 0.5) / f64::from(WIDTH);
            let theta = PI * (f64::from(i / WIDTH) + 0.5) / f64::from(HEIGHT);
            [value(phi, theta) as f32; 3]
        })
        .collect();
    let map = Texture {
        width: WIDTH,
        height: HEIGHT,
        texels: Texels::Float(&texels),
        wrap: Wrap::REPEAT,
        transform: TextureTransform::IDENTITY,
        second_set: false,
    };
    // The middle of a map is −x.
    let camera = Camera::look_at(Vec3::new(3.0, 1.0, 2.0), Vec3::new(2.0, 1.0, 2.0), Vec3::Y, 40.0);
    let mut scene = SceneBuffers::new(camera.panorama());
    let map_id = Some(TextureId(0));
    scene.environment =
        Some(Environment { radiance: Rgb::ONE, map: map_id, to_map: Mat3::IDENTITY, disc: None });
    let textures = [map];
    let size = 16;
    let result = render_square(&scene.textured(&textures), Method::Path, size, 256, |_| ());
    for (i, pixel) in (0..size * size).zip(&result.image.pixels) {
        const SUB: u32 = 16;
        let mut expected = 0.0;
        for k in 0..SUB * SUB {
            let at = |pixel: u32, k: u32| (f64::from(pixel) + (f64::from(k) + 0.5) / f64::from(SUB)) / 16.0;
            expected += value(TAU * at(i % size, k % SUB), PI * at(i / size, k / SUB));
        }
        expected /= f64::from(SUB * SUB);
        // Noise of 256 stratified samples of a smooth function.
        assert!((f64::from(pixel[0]) - expected).abs() < 2e-3, "pixel {i}: {} {expected}", pixel[0]);
    }
}

/// The Cornell box seen from above by parallel rays, by such rays with a lens, and all around.
fn cameras() -> [Camera; 3] {
    let inside = Camera::look_at(Vec3::new(0.5, 0.75, 0.35), Vec3::new(0.5, 0.2, 0.6), Vec3::Y, 40.0);
    let parallel = inside.orthographic(0.5);
    [parallel, Camera { lens_radius: 0.03, focus_distance: 0.4, ..parallel }, inside.panorama()]
}

/// Standard deviations of the widest of a thousand differences.
const WIDEST: f64 = 6.0;

#[test]
fn methods_agree_with_paths_for_each_kind_of_camera() {
    const REPLICAS: u32 = 12;
    let mut scene = cornell_box();
    for camera in cameras() {
        scene.camera = camera;
        let pictures = |method: Method, spp: u32| -> Vec<Vec<f64>> {
            let picture = |seed| {
                let result = render_square(&scene.scene(), method, 32, spp, |settings| settings.seed = seed);
                assert_eq!(result.counters.dropped.total(), 0);
                blocks(&result.image)
            };
            (0..REPLICAS).map(picture).collect()
        };
        let paths = pictures(Method::Path, 32);
        for method in [Method::Bidirectional, Method::LightTracing, Method::VertexMerging] {
            // Light tracing does not show the lamp itself: see the textbook comparison for its splats.
            if method == Method::LightTracing && camera.lens_radius > 0.0 {
                continue;
            }
            let others = pictures(method, 32);
            if let Err(why) = agree(&others, &paths, WIDEST) {
                panic!("{method:?}, {:?}: {why}", camera.kind);
            }
        }
    }
}

#[test]
fn pixels_of_an_orthographic_picture_have_the_size_of_their_points() {
    let camera = parallel();
    let place = |x: f32| -> DVec3 { camera.ray(SIZE, SIZE, x, 6.0, [0.5; 2]).at(3.0).as_dvec3() };
    assert!((place(7.0).distance(place(6.0)) - 0.1).abs() < 1e-6);
}
