//! Surfaces at the ends of their ranges.

use super::Table;
use super::world::{World, glowing, made_of};
use glam::DVec3;
use halflight_core::Rgb;
use halflight_core::scene::{Material, Surface};

pub(super) fn cases(table: &mut Table) {
    for reflectance in [0.0f32, 0.5, 0.9, 0.97, 0.99, 0.999] {
        let expected = 1.0 / (1.0 - f64::from(reflectance));
        let world = World { spp: 256, ..World::furnace(reflectance, 1.0) };
        table.radiance("albedo", format!("a box that reflects {reflectance} and emits 1"), &world, expected);
    }
    for reflectance in [0.0, 1.0f32, 1.0 - f32::EPSILON, 1.0 - 1e-3] {
        let world = under_the_sky(made_of(Surface::Diffuse { reflectance: Rgb::splat(reflectance).into() }));
        table.radiance(
            "albedo",
            format!("a plane that reflects {reflectance} under a sky of 1"),
            &world,
            f64::from(reflectance),
        );
    }
    let mut white = World::furnace(1.0, 0.0);
    white.materials[0] = glowing(1.0, 0.0);
    table.radiance("albedo", "a closed white box without light: paths end", &white, 0.0);
    roughness(table);
    glass(table);
    mirrors(table);
}

/// A large plane seen from straight above, under a sky of 1.
fn under_the_sky(material: Material) -> World {
    let mut world = World { sky: Some(1.0), ..World::new(DVec3::Y, DVec3::ZERO, 0.1) };
    let material = world.material(material);
    world.square(DVec3::ZERO, 4.0, true, material);
    world
}

/// Of what falls straight onto a white GGX surface, the share that leaves it after one reflection: the mean of Smith's
/// masking over reflected directions, half-vectors distributed by D cos (Walter 2007, eq. 33 to 35).
fn reflected_by_ggx(alpha: f64) -> f64 {
    const STEPS: u32 = 1 << 20;
    let a2 = alpha * alpha;
    let share = |u: f64| {
        let cos2 = (1.0 - u) / (1.0 + (a2 - 1.0) * u);
        let c = 2.0 * cos2 - 1.0;
        if c <= 0.0 { 0.0 } else { 2.0 * c / (c + (a2 + (1.0 - a2) * c * c).sqrt()) }
    };
    (0..STEPS).map(|i| share((f64::from(i) + 0.5) / f64::from(STEPS))).sum::<f64>() / f64::from(STEPS)
}

fn roughness(table: &mut Table) {
    for alpha in [1e-9f64, 0.99e-4, 1e-4, 1.01e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0] {
        let roughness = (alpha.sqrt() as f32).into();
        let world = under_the_sky(made_of(Surface::Conductor { reflectance: Rgb::ONE.into(), roughness }));
        table.radiance(
            "roughness",
            format!("white metal of alpha {alpha:e}"),
            &world,
            reflected_by_ggx(alpha),
        );
    }
    // Without absorption glass only bends light of a sky that is the same everywhere.
    for alpha in [1e-4f64, 1e-3, 1e-2] {
        let surface =
            Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: (alpha.sqrt() as f32).into() };
        // What shadowing takes away at both sides: less than alpha.
        table.radiance_within(
            "roughness",
            format!("a slab of glass of alpha {alpha:e}"),
            &slab(surface),
            1.0,
            alpha,
        );
    }
}

/// A slab seen from straight above, under a sky of 1 on all sides.
fn slab(surface: Surface) -> World {
    let mut world = World { sky: Some(1.0), ..World::new(DVec3::new(0.0, 3.0, 0.0), DVec3::ZERO, 20.0) };
    let material = world.material(made_of(surface));
    world.cuboid(DVec3::new(-2.0, -0.1, -2.0), DVec3::new(2.0, 0.1, 2.0), false, material);
    world
}

fn glass(table: &mut Table) {
    let smooth = |ior: f32| Surface::Dielectric { ior, tint: Rgb::ONE, roughness: 0.0.into() };
    for ior in [1.0f32, 1.0 + 1e-6, 1.0 - 1e-6, 1.33, 1.5, 10.0, 0.5] {
        table.radiance("index of refraction", format!("a slab of index {ior}"), &slab(smooth(ior)), 1.0);
    }
    // One within the other: water in glass has the index of water over that of glass.
    let mut nested = slab(smooth(1.5));
    let water = nested.material(made_of(smooth(1.33 / 1.5)));
    let air = nested.material(made_of(smooth(1.0 / 1.33)));
    nested.cuboid(DVec3::new(-1.9, -0.06, -1.9), DVec3::new(1.9, 0.06, 1.9), false, water);
    nested.cuboid(DVec3::new(-1.8, -0.03, -1.8), DVec3::new(1.8, 0.03, 1.8), false, air);
    table.radiance("index of refraction", "air in water in glass", &nested, 1.0);
}

/// The end of a corridor between two perfect mirrors, after `bounces` of them.
fn corridor(bounces: u32) -> World {
    // Mirrors at x = −1 and 1; a ray from the middle rises by 1 for 2 bounces and leaves them for the sky.
    let height = f64::from(bounces);
    let mut world = World { sky: Some(1.0), ..World::new(DVec3::ZERO, DVec3::new(1.0, 0.5, 0.0), 0.002) };
    let mirror = world.material(made_of(Surface::Mirror { reflectance: Rgb::ONE.into() }));
    let top = 0.5 * height;
    for x in [-1.0, 1.0] {
        let at = |y: f64, z: f64| DVec3::new(x, y, z);
        world.quad([at(-1.0, -2.0), at(-1.0, 2.0), at(2.0 * top, 2.0), at(2.0 * top, -2.0)], mirror);
    }
    world.spp = 256;
    world
}

fn mirrors(table: &mut Table) {
    for bounces in [1, 10, 100, 1000] {
        let world = corridor(bounces);
        table.radiance("mirrors", format!("{bounces} bounces between two that are perfect"), &world, 1.0);
    }
    let mut closed = World::furnace(0.0, 0.0);
    closed.materials[0] = made_of(Surface::Mirror { reflectance: Rgb::ONE.into() });
    table.radiance("mirrors", "a closed box of perfect ones without light: paths end", &closed, 0.0);
    let glow = glowing(0.0, 1.0).emission;
    closed.materials[0] =
        Material { emission: glow, ..made_of(Surface::Mirror { reflectance: Rgb::splat(0.9).into() }) };
    table.radiance("mirrors", "a closed box of those that reflect 0.9 and emit 1", &closed, 10.0);
}
