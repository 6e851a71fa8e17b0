//! Direct light with an analytic irradiance, and transmittance of cut-outs.

use crate::picture::{SIZE, assert_picture};
use core::f64::consts::PI;
use glam::{DVec3, Vec3};
use halflight_core::Rgb;
use halflight_core::scene::PointLight;
use halflight_core::scene::{Camera, Material};
use halflight_tests::scenes::{SceneBuffers, emitter};

const REFLECTANCE: f32 = 0.6;

/// A diffuse floor in the plane y = 0, seen from below all lights.
fn floor() -> SceneBuffers {
    let eye = Vec3::new(0.0, 0.6, 1.0);
    let mut scene = SceneBuffers::new(Camera::look_at(eye, Vec3::new(0.0, 0.0, 0.3), Vec3::Y, 40.0));
    let grey = scene.material(Material::diffuse(Rgb::splat(REFLECTANCE)));
    scene.square(Vec3::ZERO, Vec3::Y, 8.0, grey);
    scene
}

/// Mean over pixel (x, y) of the floor's reflected radiance, from the irradiance at its points.
fn seen(camera: &Camera, x: u32, y: u32, irradiance: impl Fn(DVec3) -> f64) -> f64 {
    const SUB: u32 = 16;
    let mut sum = 0.0;
    for i in 0..SUB * SUB {
        let [dx, dy] = [i % SUB, i / SUB].map(|k| (k as f32 + 0.5) / SUB as f32);
        let ray = camera.ray(SIZE, SIZE, x as f32 + dx, y as f32 + dy, [0.5; 2]);
        let t = -ray.origin[1] / ray.direction[1];
        sum += irradiance(ray.at(t).as_dvec3());
    }
    sum / f64::from(SUB * SUB) * f64::from(REFLECTANCE) / PI
}

/// Irradiance by a polygon of radiance 1 on a point with normal +y (Lambert 1760).
fn polygon_irradiance(corners: &[DVec3], at: DVec3) -> f64 {
    let edge = |i: usize| {
        let (a, b) = (corners[i] - at, corners[(i + 1) % corners.len()] - at);
        a.angle_between(b) * a.cross(b).normalize().y
    };
    0.5 * (0..corners.len()).map(edge).sum::<f64>().abs()
}

#[test]
fn a_parallel_square_lights_the_floor_by_its_form_factor() {
    for depth in [Some(2), None] {
        let mut scene = floor();
        // A black lamp, so that no light bounces between it and the floor.
        let lamp = scene.material(emitter(0.0, 3.0));
        scene.square(Vec3::new(0.0, 0.7, -0.6), Vec3::NEG_Y, 1.0, lamp);
        let corners =
            [[-0.5, -1.1], [0.5, -1.1], [0.5, -0.1], [-0.5, -0.1]].map(|[x, z]| DVec3::new(x, 0.7, z));
        let camera = scene.camera;
        assert_picture(
            &scene,
            |settings| settings.max_depth = depth,
            |x, y| seen(&camera, x, y, |p| 3.0 * polygon_irradiance(&corners, p)),
        );
    }
}

#[test]
fn lights_without_surface_light_the_floor_by_their_formulas() {
    let position = Vec3::new(0.3, 0.8, -0.2);
    let intensity = Rgb::splat(2.0);
    let from = |p: DVec3| position.as_dvec3() - p;
    let point = |p: DVec3| 2.0 * from(p).y / from(p).length().powi(3);

    let mut scene = floor();
    let camera = scene.camera;
    scene.lights.push(PointLight::Point { position, intensity });
    assert_picture(&scene, |_| (), |x, y| seen(&camera, x, y, point));

    let direction = Vec3::new(0.3, -1.0, 0.2).normalize();
    scene.lights[0] = PointLight::Directional { direction, irradiance: Rgb::splat(1.5) };
    let expected = 1.5 * f64::from(-direction.y);
    assert_picture(&scene, |_| (), |x, y| seen(&camera, x, y, |_| expected));

    // The full cone covers the whole picture.
    let down = Vec3::NEG_Y;
    scene.lights[0] =
        PointLight::Spot { position, direction: down, intensity, cos_inner: 0.01, cos_outer: 0.0 };
    assert_picture(&scene, |_| (), |x, y| seen(&camera, x, y, point));
}

#[test]
fn all_lights_together_add_up() {
    let mut scene = floor();
    let camera = scene.camera;
    let direction = Vec3::NEG_Y;
    scene.lights.push(PointLight::Directional { direction, irradiance: Rgb::splat(0.5) });
    for x in [-0.5, 0.0, 0.5] {
        let position = Vec3::new(x, 1.0, 0.0);
        scene.lights.push(PointLight::Point { position, intensity: Rgb::splat(1.0 + x) });
    }
    scene.environment = halflight_tests::scenes::constant_environment(0.25);
    let irradiance = |p: DVec3| {
        let points = [-0.5, 0.0, 0.5].map(|x| {
            let d = DVec3::new(x, 1.0, 0.0) - p;
            (1.0 + x) * d.y / d.length().powi(3)
        });
        0.5 + 0.25 * PI + points.iter().sum::<f64>()
    };
    assert_picture(&scene, |_| (), |x, y| seen(&camera, x, y, irradiance));
}

#[test]
fn cutouts_let_through_what_they_do_not_cover() {
    // The floor, lit through two sheets, is seen through a third, black one. Opacities are multiples of 1/64,
    // the samples of a pixel, so that stratification makes them exact and rare events do not mislead the
    // t-test.
    let mut scene = floor();
    let camera = scene.camera;
    let sheet = |opacity: f32| Material { opacity: opacity.into(), ..Material::diffuse(Rgb::ZERO) };
    let (veil, filter) = (scene.material(sheet(0.25)), scene.material(sheet(0.5)));
    scene.square(camera.eye + 0.1 * camera.forward, -camera.forward, 1.0, veil);
    scene.square(Vec3::new(0.0, 3.0, 0.0), Vec3::Y, 50.0, filter);
    scene.square(Vec3::new(0.0, 3.5, 0.0), Vec3::NEG_Y, 50.0, filter);
    let position = Vec3::new(0.0, 4.0, 0.0);
    scene.lights.push(PointLight::Point { position, intensity: Rgb::splat(20.0) });
    let irradiance = |p: DVec3| {
        let d = position.as_dvec3() - p;
        0.75 * 0.25 * 20.0 * d.y / d.length().powi(3)
    };
    assert_picture(&scene, |_| (), |x, y| seen(&camera, x, y, irradiance));
}
