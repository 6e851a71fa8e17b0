//! Surfaces with extreme parameters.

use super::Table;
use super::scene::{TestScene, emitter, with_surface};
use glam::DVec3;
use halflight_core::Rgb;
use halflight_core::scene::{Material, Surface};

pub(super) fn cases(table: &mut Table) {
    for reflectance in [0.0f32, 0.5, 0.9, 0.97, 0.99, 0.999] {
        let expected = 1.0 / (1.0 - f64::from(reflectance));
        let scene = TestScene { spp: 256, ..TestScene::furnace(reflectance, 1.0) };
        table.radiance("albedo", format!("a box that reflects {reflectance} and emits 1"), &scene, expected);
    }
    for reflectance in [0.0, 1.0f32, 1.0 - f32::EPSILON, 1.0 - 1e-3] {
        let scene =
            under_the_sky(with_surface(Surface::Diffuse { reflectance: Rgb::splat(reflectance).into() }));
        table.radiance(
            "albedo",
            format!("a plane that reflects {reflectance} under a sky of 1"),
            &scene,
            f64::from(reflectance),
        );
    }
    let mut white = TestScene::furnace(1.0, 0.0);
    white.materials[0] = emitter(1.0, 0.0);
    table.radiance("albedo", "a closed white box without light: paths end", &white, 0.0);
    roughness(table);
    glass(table);
    mirrors(table);
}

/// Large plane seen from above, under a sky of 1.
fn under_the_sky(material: Material) -> TestScene {
    let mut scene = TestScene { sky: Some(1.0), ..TestScene::new(DVec3::Y, DVec3::ZERO, 0.1) };
    let material = scene.material(material);
    scene.square(DVec3::ZERO, 4.0, true, material);
    scene
}

/// Albedo of a white GGX surface for vertical light and one reflection: the mean of Smith's masking over
/// reflected directions, with half-vectors distributed by D cos (Walter 2007, eq. 33 to 35).
fn ggx_albedo(alpha: f64) -> f64 {
    const STEPS: u32 = 1 << 20;
    let a2 = alpha * alpha;
    let masking = |u: f64| {
        let cos2 = (1.0 - u) / (1.0 + (a2 - 1.0) * u);
        let c = 2.0 * cos2 - 1.0;
        if c <= 0.0 { 0.0 } else { 2.0 * c / (c + (a2 + (1.0 - a2) * c * c).sqrt()) }
    };
    (0..STEPS).map(|i| masking((f64::from(i) + 0.5) / f64::from(STEPS))).sum::<f64>() / f64::from(STEPS)
}

fn roughness(table: &mut Table) {
    for alpha in [1e-9f64, 0.99e-4, 1e-4, 1.01e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0] {
        let roughness = (alpha.sqrt() as f32).into();
        let scene =
            under_the_sky(with_surface(Surface::Conductor { reflectance: Rgb::ONE.into(), roughness }));
        table.radiance("roughness", format!("white metal of alpha {alpha:e}"), &scene, ggx_albedo(alpha));
    }
    // Glass without absorption does not change a uniform sky.
    for alpha in [1e-4f64, 1e-3, 1e-2] {
        let surface =
            Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: (alpha.sqrt() as f32).into() };
        // Shadowing at both sides loses less than alpha.
        table.radiance_within(
            "roughness",
            format!("a slab of glass of alpha {alpha:e}"),
            &slab(surface),
            1.0,
            alpha,
        );
    }
}

/// Slab seen from above, under a sky of 1 on all sides.
fn slab(surface: Surface) -> TestScene {
    let mut scene =
        TestScene { sky: Some(1.0), ..TestScene::new(DVec3::new(0.0, 3.0, 0.0), DVec3::ZERO, 20.0) };
    let material = scene.material(with_surface(surface));
    scene.cuboid(DVec3::new(-2.0, -0.1, -2.0), DVec3::new(2.0, 0.1, 2.0), false, material);
    scene
}

fn glass(table: &mut Table) {
    let smooth = |ior: f32| Surface::Dielectric { ior, tint: Rgb::ONE, roughness: 0.0.into() };
    for ior in [1.0f32, 1.0 + 1e-6, 1.0 - 1e-6, 1.33, 1.5, 10.0, 0.5] {
        table.radiance("index of refraction", format!("a slab of index {ior}"), &slab(smooth(ior)), 1.0);
    }
    // Relative indices: water in glass has the index of water over that of glass.
    let mut nested = slab(smooth(1.5));
    let water = nested.material(with_surface(smooth(1.33 / 1.5)));
    let air = nested.material(with_surface(smooth(1.0 / 1.33)));
    nested.cuboid(DVec3::new(-1.9, -0.06, -1.9), DVec3::new(1.9, 0.06, 1.9), false, water);
    nested.cuboid(DVec3::new(-1.8, -0.03, -1.8), DVec3::new(1.8, 0.03, 1.8), false, air);
    table.radiance("index of refraction", "air in water in glass", &nested, 1.0);
}

/// View between two perfect mirrors whose camera rays leave for the sky after `bounces` reflections.
fn corridor(bounces: u32) -> TestScene {
    // Mirrors at x = −1 and 1; a ray from the middle rises by 1 per two reflections.
    let height = f64::from(bounces);
    let mut scene =
        TestScene { sky: Some(1.0), ..TestScene::new(DVec3::ZERO, DVec3::new(1.0, 0.5, 0.0), 0.002) };
    let mirror = scene.material(with_surface(Surface::Mirror { reflectance: Rgb::ONE.into() }));
    let top = 0.5 * height;
    for x in [-1.0, 1.0] {
        let at = |y: f64, z: f64| DVec3::new(x, y, z);
        scene.quad([at(-1.0, -2.0), at(-1.0, 2.0), at(2.0 * top, 2.0), at(2.0 * top, -2.0)], mirror);
    }
    scene.spp = 256;
    scene
}

fn mirrors(table: &mut Table) {
    for bounces in [1, 10, 100, 1000] {
        let scene = corridor(bounces);
        table.radiance("mirrors", format!("{bounces} bounces between two that are perfect"), &scene, 1.0);
    }
    let mut closed = TestScene::furnace(0.0, 0.0);
    closed.materials[0] = with_surface(Surface::Mirror { reflectance: Rgb::ONE.into() });
    table.radiance("mirrors", "a closed box of perfect ones without light: paths end", &closed, 0.0);
    let emission = emitter(0.0, 1.0).emission;
    closed.materials[0] =
        Material { emission, ..with_surface(Surface::Mirror { reflectance: Rgb::splat(0.9).into() }) };
    table.radiance("mirrors", "a closed box of those that reflect 0.9 and emit 1", &closed, 10.0);
}
