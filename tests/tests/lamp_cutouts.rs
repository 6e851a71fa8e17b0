//! Emitters with cut-outs: only the opaque part emits, in every method. Opacity is a probability: visible and
//! emitted light are proportional to it.

use glam::Vec3;
use halflight::render::{Method, Settings};
use halflight_core::Rgb;
use halflight_core::scene::{Camera, Material, Scene, Surface};
use halflight_tests::render::{difference, has_photons, render};
use halflight_tests::scenes::{
    SceneBuffers, constant_environment, emitter, glass, lamp_over_ball, room_with_lamp,
};

/// Relative tolerance of means of 24 x 24 pixels and 64 samples; their standard errors are below a quarter of
/// it.
const TOLERANCE: f64 = 0.02;

fn mean(scene: &Scene, method: Method, change: impl FnOnce(&mut Settings)) -> f64 {
    render(scene, method, 24, 64, change).image.mean()[1]
}

/// A sheet of `material` that fills the picture, before a sky of radiance 0.3.
fn sheet(material: Material) -> SceneBuffers {
    let mut buffers = SceneBuffers::new(Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 40.0));
    let material = buffers.material(material);
    buffers.square(Vec3::ZERO, Vec3::Z, 2.0, material);
    buffers.environment = constant_environment(0.3);
    buffers
}

#[test]
fn a_lamp_is_seen_as_often_as_it_is_there_and_what_is_behind_it_else() {
    for method in Method::ALL {
        for (opacity, two_sided) in [(0.0, false), (0.1, false), (0.1, true), (0.75, false), (1.0, true)] {
            let buffers = sheet(Material { opacity: opacity.into(), two_sided, ..emitter(0.0, 2.0) });
            let expected = f64::from(opacity) * 2.0 + (1.0 - f64::from(opacity)) * 0.3;
            let found = mean(&buffers.scene(), method, |_| ());
            let name = method.name();
            assert!((found / expected - 1.0).abs() < TOLERANCE, "{name} {opacity}: {found}, not {expected}");
        }
    }
}

#[test]
fn a_lamp_behind_a_veil_shows_in_its_holes() {
    for method in Method::ALL {
        let mut buffers = sheet(Material { opacity: 0.4.into(), ..emitter(0.0, 1.0) });
        let lamp = buffers.material(Material { opacity: 0.5.into(), ..emitter(0.0, 8.0) });
        buffers.square(Vec3::NEG_Z, Vec3::Z, 5.0, lamp);
        let expected = 0.4 + 0.6 * (0.5 * 8.0 + 0.5 * 0.3);
        let found = mean(&buffers.scene(), method, |_| ());
        assert!((found / expected - 1.0).abs() < TOLERANCE, "{}: {found}, not {expected}", method.name());
    }
}

#[test]
fn a_cut_out_is_met_as_often_after_another_that_scattered() {
    // A mirror of opacity 0.5 sends half of the paths to a black sheet of opacity 0.5 behind the camera.
    for method in Method::ALL {
        let mirror = Surface::Mirror { reflectance: Rgb::ONE.into() };
        let mut buffers = sheet(Material { opacity: 0.5.into(), surface: mirror, ..emitter(0.0, 0.0) });
        let black = buffers.material(Material { opacity: 0.5.into(), ..emitter(0.0, 0.0) });
        buffers.square(Vec3::Z * 2.0, Vec3::NEG_Z, 9.0, black);
        let expected = 0.3 * (0.5 + 0.5 * 0.5);
        let found = mean(&buffers.scene(), method, |_| ());
        assert!((found / expected - 1.0).abs() < TOLERANCE, "{}: {found}, not {expected}", method.name());
    }
}

#[test]
fn a_lamp_lights_as_much_as_is_there_of_it() {
    for method in Method::ALL {
        let render = |opacity: f32| {
            let buffers = room_with_lamp(opacity, 6.0);
            render(&buffers.scene(), method, 32, 64, |_| ()).image
        };
        let (all, none) = (render(1.0), render(0.0));
        assert!(all.mean()[1] > 0.02 && none.mean() == [0.0; 3], "{}", method.name());
        // The holes also transmit light that is reflected upwards: one part in a hundred.
        let mut quarter = render(0.25);
        quarter.pixels.iter_mut().flatten().for_each(|value| *value *= 4.0);
        let (found, expected) = (quarter.mean()[1], all.mean()[1]);
        assert!((found / expected - 1.0).abs() < 0.03, "{}: {found}, not {expected}", method.name());
        assert!(difference(&quarter, &all) < 0.1, "{}: {}", method.name(), difference(&quarter, &all));
    }
}

#[test]
fn photons_and_paths_share_the_light_of_a_lamp_with_holes() {
    // A glass ball under a lamp: photons and paths both find its caustic.
    let render = |opacity: f32, radiance: f32, spp: u32, change: fn(&mut Settings)| {
        let mut buffers = lamp_over_ball(glass(0.0), 0.3);
        let lamp = buffers.materials.last_mut().unwrap();
        *lamp = Material { opacity: opacity.into(), ..emitter(0.0, radiance) };
        render(&buffers.scene(), Method::Path, 24, spp, change)
    };
    let holes = render(0.25, 400.0, 128, |_| ());
    assert!(has_photons(&holes));
    for (name, other) in [
        ("whole", render(1.0, 100.0, 128, |_| ())),
        ("by paths", render(0.25, 400.0, 2048, |s| s.caustics = false)),
    ] {
        let (found, expected) = (holes.image.mean()[1], other.image.mean()[1]);
        assert!((found / expected - 1.0).abs() < 0.04, "{name}: {found}, not {expected}");
    }
}

#[test]
fn a_lamp_with_holes_shows_in_a_mirror_as_it_is() {
    let mut buffers = SceneBuffers::new(Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 30.0));
    let surface = halflight_core::scene::Surface::Mirror { reflectance: Rgb::splat(0.5).into() };
    let mirror = buffers.material(Material { surface, ..Material::GREY });
    let lamp = buffers.material(Material { opacity: 0.2.into(), ..emitter(0.0, 3.0) });
    buffers.square(Vec3::ZERO, Vec3::Z, 2.0, mirror);
    buffers.square(Vec3::new(0.0, 0.0, 2.0), Vec3::NEG_Z, 9.0, lamp);
    for method in Method::ALL {
        let found = mean(&buffers.scene(), method, |_| ());
        assert!((found / 0.3 - 1.0).abs() < TOLERANCE, "{}: {found}, not 0.3", method.name());
    }
}
