//! Cameras at extreme positions, and pictures of extreme sizes.

use super::Table;
use super::scene::{TestScene, with_surface};
use glam::{DQuat, DVec3};
use halflight_core::Rgb;
use halflight_core::scene::Surface;

pub(super) fn cases(table: &mut Table) {
    let from = |eye: DVec3, look_at: DVec3| TestScene { eye, look_at, ..TestScene::furnace(0.5, 1.0) };
    let positions = [
        ("on a wall, looking in", DVec3::X, DVec3::ZERO),
        ("on a slanted wall", DVec3::new(0.0, 0.4, 0.3), DVec3::new(0.1, -0.3, 0.2)),
        ("on an edge", DVec3::new(1.0, 1.0, 0.0), DVec3::ZERO),
        ("in a corner", DVec3::ONE, DVec3::ZERO),
        ("1e-7 before a wall", DVec3::new(0.999_999_9, 0.0, 0.0), DVec3::ZERO),
    ];
    for (case, eye, look_at) in positions {
        let mut scene = from(eye, look_at);
        // From the corner a wider view would leave the box: walls are 35 degrees off the diagonal.
        (scene.fov, scene.spp) = (50.0, 256);
        if case.contains("slanted") {
            // A rotation after which no wall has a round coordinate.
            let rotation = DQuat::from_axis_angle(DVec3::new(0.6, 0.48, 0.64), 1.1);
            for position in &mut scene.positions {
                *position = (rotation * DVec3::from(*position)).to_array();
            }
            (scene.eye, scene.look_at) = (rotation * DVec3::new(0.3, 1.0, -0.2), DVec3::ZERO);
        }
        table.radiance("camera", case, &scene, 2.0);
    }
    for fov in [0.01, 1.0, 120.0, 170.0] {
        let scene = TestScene { fov, ..TestScene::furnace(0.5, 1.0) };
        table.radiance("camera", format!("a field of view of {fov} degrees"), &scene, 2.0);
    }
    // Radiance in glass is n² times the radiance outside.
    let mut scene = TestScene { sky: Some(1.0), ..TestScene::new(DVec3::ZERO, DVec3::NEG_Z, 10.0) };
    let surface = Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: 0.0.into() };
    let glass = scene.material(with_surface(surface));
    scene.cuboid(DVec3::NEG_ONE, DVec3::ONE, false, glass);
    table.radiance("camera", "within glass of index 1.5, under a sky of 1", &scene, 2.25);

    for (size, spp) in [([1, 1], 16384), ([1, 16384], 16), ([16384, 1], 16), ([17, 3], 256)] {
        // Similar angles for all shapes of the picture.
        let fov = if size[0] > size[1] { 0.01 } else { 70.0 };
        let scene = TestScene { size, spp, fov, ..TestScene::furnace(0.5, 1.0) };
        table.radiance("size of the picture", format!("{} x {} pixels", size[0], size[1]), &scene, 2.0);
    }
}
