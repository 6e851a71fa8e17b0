//! Lights, from far smaller to far larger than what they light, from faint to blinding.

use super::Table;
use super::world::{World, glowing};
use core::f64::consts::PI;
use glam::{DQuat, DVec3};
use halflight_core::Rgb;
use halflight_core::scene::Material;

/// Irradiance by a parallel square of side `s` and radiance 1 at distance 1 on the point below its centre: four times
/// the form factor of a quarter (Howell's catalogue, B-3), times π.
fn under_a_square(s: f64) -> f64 {
    let a = 0.5 * s;
    let root = (1.0 + a * a).sqrt();
    4.0 * (a / root) * (a / root).atan()
}

pub(super) fn cases(table: &mut Table) {
    for exponent in [-9, -6, -3, -1, 0, 1, 3, 6, 9] {
        let side = 10f64.powi(exponent);
        let irradiance = under_a_square(side);
        // As bright as makes the irradiance 1.
        let radiance = (1.0 / irradiance) as f32;
        let mut world = World::new(DVec3::new(0.0, 0.5, 0.3), DVec3::ZERO, 0.02);
        let grey = world.material(Material::diffuse(Rgb::splat(0.6)));
        let lamp = world.material(glowing(0.0, radiance));
        world.square(DVec3::ZERO, 0.1, true, grey);
        world.square(DVec3::Y, side, false, lamp);
        let expected = 0.6 / PI * irradiance * f64::from(radiance);
        table.radiance(
            "size of a light",
            format!("a square of side 1e{exponent} at distance 1"),
            &world,
            expected,
        );
    }
    for exponent in [-20, -10, -5, 0, 5, 10, 20] {
        let radiance = 10f64.powi(exponent) as f32;
        let world = World::furnace(0.5, radiance);
        table.radiance(
            "radiance",
            format!("a box that emits 1e{exponent}"),
            &world,
            2.0 * f64::from(radiance),
        );
    }
    // Both are seen; the faint one must not be lost beside the bright one.
    let mut world = World::new(DVec3::new(0.0, 0.5, 0.3), DVec3::ZERO, 0.02);
    let grey = world.material(Material::diffuse(Rgb::splat(0.6)));
    let (faint, bright) = (world.material(glowing(0.0, 1e-3)), world.material(glowing(0.0, 1e6)));
    world.square(DVec3::ZERO, 0.1, true, grey);
    world.square(DVec3::Y, 1.0, false, faint);
    // Behind the floor: it lights nothing.
    world.square(-DVec3::Y, 1.0, false, bright);
    let expected = 0.6 / PI * 1e-3 * under_a_square(1.0);
    table.radiance("radiance", "1e-3 in front of a floor, 1e6 behind it", &world, expected);
    backs(table);
}

/// Lamps whose backs reflect, in the dark: nothing of what the front emits may get there, however positions are rounded.
fn backs(table: &mut Table) {
    for (case, tilt) in
        [("a level lamp", 0.0), ("a lamp tilted by 0.3 rad", 0.3), ("a lamp on edge", 0.5 * PI)]
    {
        let turned = DQuat::from_rotation_z(tilt);
        let center = DVec3::new(-0.005, 1.98, -0.03);
        let mut world = World::new(center + turned * DVec3::new(0.4, 0.9, 0.7), center, 30.0);
        let lamp = world.material(glowing(0.78, 17.0));
        world.square(DVec3::ZERO, 0.47, false, lamp);
        for position in &mut world.positions {
            *position = (center + turned * DVec3::from(*position)).to_array();
        }
        table.radiance("a light's own back", case, &world, 0.0);
    }
}
