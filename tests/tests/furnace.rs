//! Furnaces: scenes of constant radiance, in which every wrong factor shows.

use crate::picture::{self, assert_picture};
use glam::Vec3;
use halflight_core::Rgb;
use halflight_core::scene::{Camera, CameraKind, Material, Surface};
use halflight_tests::scenes::{SceneBuffers, constant_environment, emitter};

const INSIDE: Camera = Camera {
    kind: CameraKind::Perspective,
    eye: Vec3::new(0.1, -0.2, 0.3),
    right: Vec3::X,
    up: Vec3::Y,
    forward: Vec3::NEG_Z,
    tan_half_fov: 0.7,
    lens_radius: 0.0,
    focus_distance: 1.0,
    start: None,
};

#[test]
fn a_closed_box_glows_with_le_over_one_minus_rho() {
    for (reflectance, radiance) in [(0.0, 1.0), (0.5, 1.0), (0.8, 0.3)] {
        let mut scene = SceneBuffers::new(INSIDE);
        let glow = scene.material(emitter(reflectance, radiance));
        scene.cuboid(Vec3::NEG_ONE, Vec3::ONE, true, glow);
        let expected = f64::from(radiance) / (1.0 - f64::from(reflectance));
        assert_picture(&scene, |_| (), |_, _| expected);
    }
}

#[test]
fn twice_the_emission_is_twice_the_light_to_the_bit() {
    let room = |radiance: f32| {
        let mut scene = SceneBuffers::new(INSIDE);
        let white = scene.material(Material::diffuse(Rgb::splat(0.7)));
        let lamp = scene.material(emitter(0.7, radiance));
        scene.cuboid(Vec3::NEG_ONE, Vec3::ONE, true, white);
        for triangle in &mut scene.triangles[6..8] {
            triangle.material = lamp;
        }
        picture::render(&scene, 0, |_| ())
    };
    let (once, twice) = (room(1.0), room(2.0));
    assert!(once.iter().zip(&twice).all(|(a, b)| 2.0 * a == *b && *a > 0.0));
}

/// A cube of `surface` under a sky of radiance 1.
fn under_the_sky(surface: Surface) -> SceneBuffers {
    let eye = Vec3::new(0.4, 0.7, 3.0);
    let mut scene = SceneBuffers::new(Camera::look_at(eye, Vec3::ZERO, Vec3::Y, 50.0));
    let material = scene.material(Material { surface, ..Material::GREY });
    scene.cuboid(Vec3::splat(-0.7), Vec3::splat(0.7), false, material);
    scene.environment = constant_environment(1.0);
    scene
}

const WHITE: Rgb = Rgb::ONE;

#[test]
fn white_convex_things_vanish_under_a_white_sky() {
    let diffuse = Surface::Diffuse { reflectance: WHITE.into() };
    let mirror = Surface::Mirror { reflectance: WHITE.into() };
    for surface in [diffuse, mirror] {
        assert_picture(&under_the_sky(surface), |_| (), |_, _| 1.0);
    }
}

#[test]
fn glass_vanishes_under_a_white_sky() {
    for ior in [1.5, 1.0, 0.8] {
        let glass = Surface::Dielectric { ior, tint: WHITE, roughness: 0.0.into() };
        assert_picture(&under_the_sky(glass), |_| (), |_, _| 1.0);
    }
}

#[test]
fn clear_panes_vanish_under_a_white_sky() {
    for ior in [1.5, 1.0, 2.4] {
        let scene = under_the_sky(Surface::Pane { ior, tint: WHITE });
        assert_picture(&scene, |_| (), |_, _| 1.0);
        let pixels = picture::render(&scene, 0, |_| ());
        assert!(pixels.iter().all(|pixel| (pixel - 1.0).abs() < 1e-5), "{ior}: {pixels:?}");
    }
}

#[test]
fn nothing_gives_back_more_than_it_gets() {
    let rough = |alpha: f32| alpha.sqrt().into();
    let surfaces = [
        Surface::Conductor { reflectance: WHITE.into(), roughness: rough(0.3) },
        Surface::Conductor { reflectance: WHITE.into(), roughness: rough(1.0) },
        Surface::Glossy {
            base: WHITE.into(),
            specular: Rgb::splat(0.04).into(),
            roughness: rough(0.2),
            metallic: 0.0.into(),
            ior: None,
        },
        Surface::Glossy {
            base: WHITE.into(),
            specular: Rgb::splat(0.04).into(),
            roughness: 0.0.into(),
            metallic: 0.0.into(),
            ior: Some(1.5),
        },
        Surface::Dielectric { ior: 1.5, tint: WHITE, roughness: rough(0.3) },
    ];
    for surface in surfaces {
        let pixels = picture::render(&under_the_sky(surface), 0, |_| ());
        let mean = pixels.iter().sum::<f64>() / pixels.len() as f64;
        assert!(mean > 0.5 && mean < 1.002, "{surface:?}: {mean}");
    }
}
