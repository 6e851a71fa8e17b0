//! Sizes, positions and shapes of geometry. A closed box whose walls reflect ρ and emit L shows L / (1 − ρ)
//! everywhere, for any triangulation.

use super::Table;
use super::scene::{TestScene, emitter, faces};
use core::f64::consts::PI;
use glam::{DVec3, Vec3};
use halflight_core::Rgb;
use halflight_core::scene::PointLight;
use halflight_core::scene::{Material, Triangle};

const REFLECTANCE: f32 = 0.5;
const EXPECTED: f64 = 2.0;

fn furnace() -> TestScene {
    TestScene::furnace(REFLECTANCE, 1.0)
}

pub(super) fn cases(table: &mut Table) {
    for exponent in [-6, -4, -2, -1, 0, 1, 2, 4, 6] {
        let scene = furnace().moved(10f64.powi(exponent), DVec3::ZERO);
        table.radiance("scale", format!("a box of side 2e{exponent}"), &scene, EXPECTED);
    }
    for exponent in [1, 3, 6, 9] {
        let away = 10f64.powi(exponent);
        let scene = furnace().moved(1.0, DVec3::new(away, -0.5 * away, 0.3 * away));
        table.radiance("offset", format!("a box of side 2, 1e{exponent} from the origin"), &scene, EXPECTED);
    }
    needles(table);
    let mut scene = furnace();
    for i in 0..300 {
        let p = DVec3::new(-0.9 + 0.006 * f64::from(i), -0.5, -0.4);
        let q = if i % 2 == 0 { p } else { p + DVec3::new(0.0, 0.3, -0.2) };
        scene.triangle([p, q, 0.5 * (p + q)], 0);
    }
    table.radiance("shape", "300 triangles without area, points and lines", &scene, EXPECTED);
    coplanar(table);
    grazing(table);
    empty(table);
}

/// Walls of strips with widths that halve.
fn needles(table: &mut Table) {
    for count in [10, 20, 40] {
        let mut scene = furnace();
        (scene.positions, scene.triangles) = (Vec::new(), Vec::new());
        for [a, b, c, d] in faces(DVec3::NEG_ONE, DVec3::ONE) {
            let mut start = 0.0;
            for strip in 0..count {
                let end = if strip + 1 == count { 1.0 } else { 1.0 - 0.5f64.powi(strip + 1) };
                let (lower, upper) = (|s: f64| a + s * (b - a), |s: f64| d + s * (c - d));
                scene.quad([upper(start), upper(end), lower(end), lower(start)], 0);
                start = end;
            }
        }
        let width = 2.0 * 0.5f64.powi(count - 1);
        table.radiance("shape", format!("walls of needles, the thinnest 2 : {width:.0e}"), &scene, EXPECTED);
    }
}

/// Floor in a vertical sun, with repeated or overlapping faces.
fn coplanar(table: &mut Table) {
    let floor = |copies: u32, shifted: bool| {
        let mut scene = TestScene::new(DVec3::new(0.1, 1.0, 0.7), DVec3::ZERO, 30.0);
        let grey = scene.material(Material::diffuse(Rgb::splat(0.6)));
        for copy in 0..copies {
            let shift = if shifted { 0.37 * f64::from(copy) } else { 0.0 };
            scene.square(DVec3::new(shift, 0.0, -0.5 * shift), 8.0 + shift, true, grey);
        }
        let irradiance = Rgb::splat(1.5);
        scene.lights.push(PointLight::Directional { direction: Vec3::NEG_Y, irradiance });
        scene
    };
    let expected = 0.6 / PI * 1.5;
    table.radiance("shape", "a floor, every face once", &floor(1, false), expected);
    table.radiance("shape", "a floor, every face five times", &floor(5, false), expected);
    table.radiance("shape", "a floor of five that overlap in one plane", &floor(5, true), expected);
}

/// Floor in a sun at grazing angles.
fn grazing(table: &mut Table) {
    for angle in [1.0f64, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
        let mut scene = TestScene::new(DVec3::new(0.1, 1.0, 0.7), DVec3::ZERO, 30.0);
        let grey = scene.material(Material::diffuse(Rgb::splat(0.6)));
        scene.square(DVec3::ZERO, 4.0, true, grey);
        let direction = DVec3::new(angle.cos(), -angle.sin(), 0.0).as_vec3();
        scene.lights.push(PointLight::Directional { direction, irradiance: Rgb::ONE });
        let expected = 0.6 / PI * f64::from(-direction.y);
        table.radiance("grazing light", format!("{angle:e} rad above a floor"), &scene, expected);
    }
}

fn empty(table: &mut Table) {
    let nothing = TestScene::new(DVec3::ZERO, DVec3::NEG_Z, 50.0);
    table.radiance("empty", "no surface, no light", &nothing, 0.0);
    table.radiance(
        "empty",
        "nothing but a sky of 0.75",
        &TestScene { sky: Some(0.75), ..nothing.clone() },
        0.75,
    );
    let mut dark = furnace();
    dark.materials[0] = emitter(0.5, 0.0);
    table.radiance("empty", "a closed box without light", &dark, 0.0);
    let mut point = TestScene { sky: Some(0.5), ..nothing };
    point.material(Material::GREY);
    point.positions.push([1.0, 2.0, 3.0]);
    point.triangles.push(Triangle { vertices: [0; 3], material: 0 });
    table.radiance("empty", "one triangle, all corners the same, under a sky of 0.5", &point, 0.5);
}
