//! A closed box with a lamp under its ceiling, for tests of methods: a Cornell box, or a furnace.

use super::{PilotSize, RenderContext};
use crate::bvh::Bvh;
use crate::light::LightSampler;
use crate::memory::{Arena, Line};
use crate::scene::{Camera, ColorInput, Material, Mesh, Scene, Triangle};
use crate::transport::{PathSettings, UNLIMITED};
use crate::{Level, Rgb};
use glam::Vec3;
use std::vec;
use std::vec::Vec;

/// Pixels along a side of its picture.
pub(super) const SIDE: u32 = 32;

/// Red and green walls, white ones, and the lamp: a Cornell box.
pub(super) fn cornell() -> [Material; 4] {
    let lamp = emitting(0.0, Rgb::new(17.0, 12.0, 4.0));
    let [red, green] = [Rgb::new(0.63, 0.06, 0.05), Rgb::new(0.14, 0.45, 0.09)];
    [Material::diffuse(red), Material::diffuse(green), Material::diffuse(Rgb::splat(0.73)), lamp]
}

/// All surfaces reflect half of the light and emit 1: the radiance is 2 everywhere.
pub(super) fn furnace() -> [Material; 4] {
    [emitting(0.5, Rgb::ONE); 4]
}

fn emitting(reflectance: f32, emission: Rgb) -> Material {
    let emission = ColorInput::constant(emission);
    Material { emission, two_sided: true, ..Material::diffuse(Rgb::splat(reflectance)) }
}

/// Runs `work` on the unit cube of these materials, seen from inside.
pub(super) fn with_box<T>(materials: [Material; 4], work: impl FnOnce(&RenderContext) -> T) -> T {
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
    let mut positions: Vec<[f32; 3]> = (0..8).map(|i| corner(i).to_array()).collect();
    let lamp = [[0.35, 0.65], [0.65, 0.65], [0.65, 0.35], [0.35, 0.35]];
    positions.extend(lamp.map(|[x, z]| [x, 0.999, z]));
    // Walls, floor, ceiling, back and front, lamp.
    let quads = [
        ([0, 4, 6, 2], 0),
        ([1, 3, 7, 5], 1),
        ([0, 1, 5, 4], 2),
        ([2, 6, 7, 3], 2),
        ([0, 2, 3, 1], 2),
        ([4, 5, 7, 6], 2),
        ([8, 9, 10, 11], 3),
    ];
    let halves = |([a, b, c, d], material): ([u32; 4], u32)| {
        [[a, b, c], [a, c, d]].map(|vertices| Triangle { vertices, material })
    };
    let triangles: Vec<Triangle> = quads.into_iter().flat_map(halves).collect();
    let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
    let camera = Camera::look_at(Vec3::new(0.5, 0.5, 0.9), Vec3::new(0.5, 0.5, 0.0), Vec3::Y, 70.0);
    let scene = Scene { mesh, materials: &materials, textures: &[], lights: &[], environment: None, camera };

    let mut bvh = vec![Line([0; 64]); Bvh::footprint(triangles.len()).bytes() / 64];
    let bvh = Bvh::build(&mesh, &mut Arena::over(&mut bvh)).unwrap();
    let footprint = LightSampler::footprint(&scene).and(LightSampler::scratch(&scene));
    let mut lights = vec![Line([0; 64]); footprint.bytes() / 64];
    let lights = LightSampler::build(&scene, &mut Arena::over(&mut lights)).unwrap();
    let settings = PathSettings { width: SIDE, height: SIDE, seed: 1, max_depth: UNLIMITED };
    work(&RenderContext {
        scene: &scene,
        bvh,
        lights,
        settings,
        level: Level::detect(),
        pilots: PilotSize::USUAL,
    })
}
