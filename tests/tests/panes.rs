//! Thin panes, in every method: light passes them straight on, whether it comes by samples of lights, by
//! paths, by photons or by light paths.

use core::f64::consts::PI;
use glam::Vec3;
use halflight::render::{Method, Settings};
use halflight_core::Rgb;
use halflight_core::bsdf::Pane;
use halflight_core::scene::{Camera, Material, PointLight, Surface};
use halflight_tests::render::render;
use halflight_tests::scenes::{SceneBuffers, constant_environment, emitter, room_with_lamp};

/// Relative tolerance of means of 24 x 24 pixels and 64 samples; their standard errors are below a quarter of
/// it.
const TOLERANCE: f64 = 0.02;

const IOR: f32 = 1.5;
const TINT: Rgb = Rgb::new(1.0, 0.6, 0.2);

fn pane(tint: Rgb) -> Material {
    Material { surface: Surface::Pane { ior: IOR, tint }, ..Material::GREY }
}

fn mean(buffers: &SceneBuffers, method: Method, change: impl FnOnce(&mut Settings)) -> [f64; 3] {
    render(&buffers.scene(), method, 24, 64, change).image.mean()
}

fn assert_near(found: [f64; 3], expected: [f64; 3], what: &str) {
    let is_near = |(found, expected): (f64, f64)| (found / expected - 1.0).abs() < TOLERANCE;
    assert!(found.into_iter().zip(expected).all(is_near), "{what}: {found:?}, not {expected:?}");
}

#[test]
fn pane_shows_what_is_behind_it_and_what_it_mirrors() {
    let [reflected, passing] = Pane::new(IOR, TINT).parts(1.0);
    // A sky of 0.3 before it, a lamp of 2 behind it.
    let expected = (0.3 * reflected + 2.0 * passing).to_array().map(f64::from);
    for method in Method::ALL {
        let mut buffers = SceneBuffers::new(Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 8.0));
        let pane = buffers.material(pane(TINT));
        buffers.square(Vec3::ZERO, Vec3::Z, 2.0, pane);
        let lamp = buffers.material(emitter(0.0, 2.0));
        buffers.square(Vec3::NEG_Z, Vec3::Z, 9.0, lamp);
        buffers.environment = constant_environment(0.3);
        assert_near(mean(&buffers, method, |_| ()), expected, method.name());
    }
}

#[test]
fn point_light_shines_through_a_pane() {
    let cos = 0.6f32.cos();
    let [_, passing] = Pane::new(IOR, TINT).parts(cos);
    // Distance 1 along a direction that is 0.6 from the normals of floor and pane.
    let expected = passing.to_array().map(|t| f64::from(t * 0.5 * cos) / PI);
    for method in Method::ALL {
        let mut buffers = SceneBuffers::new(Camera::look_at(Vec3::Y, Vec3::ZERO, Vec3::X, 1.0));
        let [floor, pane] = [Material::GREY, pane(TINT)].map(|material| buffers.material(material));
        buffers.square(Vec3::ZERO, Vec3::Y, 1.0, floor);
        // Beside the camera rays.
        buffers.square(Vec3::new(1.0, 0.5, 0.0), Vec3::Y, 1.8, pane);
        let position = Vec3::new(0.6f32.sin(), cos, 0.0);
        buffers.lights.push(PointLight::Point { position, intensity: Rgb::ONE });
        assert_near(mean(&buffers, method, |settings| settings.max_depth = Some(2)), expected, method.name());
    }
}

#[test]
fn room_behind_a_pane_is_hardly_more_noisy() {
    // A room with a hole in its ceiling, under a lamp.
    let noise = |tint: Option<Rgb>| {
        let camera = Camera::look_at(Vec3::new(0.5, 0.7, 0.02), Vec3::new(0.5, 0.2, 1.0), Vec3::Y, 60.0);
        let mut buffers = SceneBuffers::new(camera);
        let wall = buffers.material(Material::diffuse(Rgb::splat(0.5)));
        buffers.square(Vec3::new(0.5, 0.0, 0.5), Vec3::Y, 1.0, wall);
        for side in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
            buffers.square(Vec3::splat(0.5) - 0.5 * side, side, 1.0, wall);
        }
        for (low, high) in [
            ([0.0, 0.0], [1.0, 0.3]),
            ([0.0, 0.7], [1.0, 1.0]),
            ([0.0, 0.3], [0.3, 0.7]),
            ([0.7, 0.3], [1.0, 0.7]),
        ] {
            let corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
            buffers.quad(corners.map(|[x, z]| Vec3::new(x, 1.0, z)), wall);
        }
        let lamp = buffers.material(emitter(0.0, 20.0));
        buffers.square(Vec3::new(0.5, 1.5, 0.5), Vec3::NEG_Y, 0.4, lamp);
        if let Some(tint) = tint {
            let pane = buffers.material(pane(tint));
            buffers.square(Vec3::new(0.5, 1.0, 0.5), Vec3::Y, 0.4, pane);
        }
        let result = render(&buffers.scene(), Method::Path, 32, 256, |settings| {
            (settings.caustics, settings.reuse) = (false, Some(false));
        });
        assert!(result.image.mean()[1] > 0.02);
        result.error.unwrap().relmse
    };
    let without = noise(None);
    for tint in [Rgb::ONE, TINT] {
        let with = noise(Some(tint));
        assert!(with < 1.3 * without, "{tint}: {with}, and {without} without a pane");
    }
}

#[test]
fn methods_agree_on_a_room_with_a_tinted_pane() {
    let room = || {
        let mut buffers = room_with_lamp(1.0, 6.0);
        let pane = buffers.material(pane(TINT));
        buffers.square(Vec3::new(0.5, 0.6, 0.5), Vec3::new(0.3, 1.0, 0.1), 0.5, pane);
        buffers
    };
    let expected = render(&room().scene(), Method::Path, 24, 1024, |_| ()).image.mean();
    // Clamped virtual lights lose light in every room.
    for method in Method::ALL.into_iter().filter(|method| *method != Method::ClampedInstantRadiosity) {
        assert_near(mean(&room(), method, |_| ()), expected, method.name());
    }
}
