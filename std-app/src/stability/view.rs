//! Cameras where none should stand, and pictures of odd sizes.

use super::Table;
use super::world::{World, made_of};
use glam::{DQuat, DVec3};
use halflight_core::Rgb;
use halflight_core::scene::Surface;

pub(super) fn cases(table: &mut Table) {
    let from = |eye: DVec3, look_at: DVec3| World { eye, look_at, ..World::furnace(0.5, 1.0) };
    let places = [
        ("on a wall, looking in", DVec3::X, DVec3::ZERO),
        ("on a slanted wall", DVec3::new(0.0, 0.4, 0.3), DVec3::new(0.1, -0.3, 0.2)),
        ("on an edge", DVec3::new(1.0, 1.0, 0.0), DVec3::ZERO),
        ("in a corner", DVec3::ONE, DVec3::ZERO),
        ("1e-7 before a wall", DVec3::new(0.999_999_9, 0.0, 0.0), DVec3::ZERO),
    ];
    for (case, eye, look_at) in places {
        let mut world = from(eye, look_at);
        // From the corner wider pictures would see the outside: walls are 35 degrees off the diagonal.
        (world.fov, world.spp) = (50.0, 256);
        if case.contains("slanted") {
            // The box turned by a third about its diagonal and a bit, so that no wall has a round coordinate.
            let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.48, 0.64), 1.1);
            for position in &mut world.positions {
                *position = (turn * DVec3::from(*position)).to_array();
            }
            (world.eye, world.look_at) = (turn * DVec3::new(0.3, 1.0, -0.2), DVec3::ZERO);
        }
        table.radiance("camera", case, &world, 2.0);
    }
    for fov in [0.01, 1.0, 120.0, 170.0] {
        let world = World { fov, ..World::furnace(0.5, 1.0) };
        table.radiance("camera", format!("a field of view of {fov} degrees"), &world, 2.0);
    }
    // Within glass radiance is n² times what it is outside.
    let mut world = World { sky: Some(1.0), ..World::new(DVec3::ZERO, DVec3::NEG_Z, 10.0) };
    let surface = Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: 0.0.into() };
    let glass = world.material(made_of(surface));
    world.cuboid(DVec3::NEG_ONE, DVec3::ONE, false, glass);
    table.radiance("camera", "within glass of index 1.5, under a sky of 1", &world, 2.25);

    for (size, spp) in [([1, 1], 16384), ([1, 16384], 16), ([16384, 1], 16), ([17, 3], 256)] {
        // As wide as high, whatever the shape of the picture.
        let fov = if size[0] > size[1] { 0.01 } else { 70.0 };
        let world = World { size, spp, fov, ..World::furnace(0.5, 1.0) };
        table.radiance("size of the picture", format!("{} x {} pixels", size[0], size[1]), &world, 2.0);
    }
}
