//! Lights of extreme size and radiance.

use super::Table;
use super::scene::{TestScene, emitter};
use core::f64::consts::PI;
use glam::{DQuat, DVec3};
use halflight_core::Rgb;
use halflight_core::scene::Material;

/// Irradiance below the centre of a parallel square of side `s` and radiance 1 at distance 1: π times four
/// times the form factor of a quarter (Howell's catalogue, B-3).
fn under_a_square(s: f64) -> f64 {
    let a = 0.5 * s;
    let root = (1.0 + a * a).sqrt();
    4.0 * (a / root) * (a / root).atan()
}

pub(super) fn cases(table: &mut Table) {
    for exponent in [-9, -6, -3, -1, 0, 1, 3, 6, 9] {
        let side = 10f64.powi(exponent);
        let irradiance = under_a_square(side);
        // Radiance for the irradiance 1.
        let radiance = (1.0 / irradiance) as f32;
        let mut scene = TestScene::new(DVec3::new(0.0, 0.5, 0.3), DVec3::ZERO, 0.02);
        let grey = scene.material(Material::diffuse(Rgb::splat(0.6)));
        let lamp = scene.material(emitter(0.0, radiance));
        scene.square(DVec3::ZERO, 0.1, true, grey);
        scene.square(DVec3::Y, side, false, lamp);
        let expected = 0.6 / PI * irradiance * f64::from(radiance);
        table.radiance(
            "size of a light",
            format!("a square of side 1e{exponent} at distance 1"),
            &scene,
            expected,
        );
    }
    for exponent in [-20, -10, -5, 0, 5, 10, 20] {
        let radiance = 10f64.powi(exponent) as f32;
        let scene = TestScene::furnace(0.5, radiance);
        table.radiance(
            "radiance",
            format!("a box that emits 1e{exponent}"),
            &scene,
            2.0 * f64::from(radiance),
        );
    }
    // The floor sees the faint lamp alone, and its sampling must not be starved by the bright one.
    let mut scene = TestScene::new(DVec3::new(0.0, 0.5, 0.3), DVec3::ZERO, 0.02);
    let grey = scene.material(Material::diffuse(Rgb::splat(0.6)));
    let (faint, bright) = (scene.material(emitter(0.0, 1e-3)), scene.material(emitter(0.0, 1e6)));
    scene.square(DVec3::ZERO, 0.1, true, grey);
    scene.square(DVec3::Y, 1.0, false, faint);
    // Behind the floor, without effect.
    scene.square(-DVec3::Y, 1.0, false, bright);
    let expected = 0.6 / PI * 1e-3 * under_a_square(1.0);
    table.radiance("radiance", "1e-3 in front of a floor, 1e6 behind it", &scene, expected);
    backs(table);
}

/// Lamps with reflecting backs: light of the front must not reach the back, for any rounding of positions.
fn backs(table: &mut Table) {
    for (case, tilt) in
        [("a level lamp", 0.0), ("a lamp tilted by 0.3 rad", 0.3), ("a lamp on edge", 0.5 * PI)]
    {
        let rotation = DQuat::from_rotation_z(tilt);
        let center = DVec3::new(-0.005, 1.98, -0.03);
        let mut scene = TestScene::new(center + rotation * DVec3::new(0.4, 0.9, 0.7), center, 30.0);
        let lamp = scene.material(emitter(0.78, 17.0));
        scene.square(DVec3::ZERO, 0.47, false, lamp);
        for position in &mut scene.positions {
            *position = (center + rotation * DVec3::from(*position)).to_array();
        }
        table.radiance("a light's own back", case, &scene, 0.0);
    }
}
