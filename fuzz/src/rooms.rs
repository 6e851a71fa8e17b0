//! Small rooms with any surfaces and lights, for targets that trace paths.

use arbitrary::{Result, Unstructured};
use glam::Vec3;
use halflight_core::bvh::Bvh;
use halflight_core::light::LightSampler;
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::scene::{Camera, Environment, Material, Mesh, PointLight, Scene, Surface, Triangle};
use halflight_core::transport::PathSettings;
use halflight_core::{Level, Rgb};

/// Calls `work` with a room, its structures, and the settings of a small picture.
pub(crate) fn with_room(
    input: &mut Unstructured,
    work: impl FnOnce(&mut Unstructured, &Scene, &Bvh, &LightSampler, PathSettings) -> Result<()>,
) -> Result<()> {
    let [walls, quads, lights, sky] = input.arbitrary::<[u8; 4]>()?;
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let mut quad = |corners: [[f32; 3]; 4], material: u8| {
        let first = positions.len() as u32;
        positions.extend(corners);
        let material = u32::from(material) % MATERIALS as u32;
        let faces = [[0, 1, 2], [0, 2, 3]].map(|face| face.map(|i| first + i));
        triangles.extend(faces.map(|vertices| Triangle { vertices, material }));
    };
    // A box that is open in front.
    if walls % 4 > 0 {
        let (a, b) = (0.0, 2.0);
        quad([[a, a, a], [a, a, b], [b, a, b], [b, a, a]], walls);
        quad([[a, b, a], [b, b, a], [b, b, b], [a, b, b]], walls >> 2);
        quad([[a, a, a], [b, a, a], [b, b, a], [a, b, a]], walls >> 4);
        quad([[a, a, a], [a, b, a], [a, b, b], [a, a, b]], walls);
        quad([[b, a, a], [b, a, b], [b, b, b], [b, b, a]], walls);
    }
    for _ in 0..quads % 6 {
        let corners = [place(input)?, place(input)?, place(input)?, place(input)?];
        quad(corners, input.arbitrary()?);
    }
    let materials = materials();
    let lights = (0..lights % 4).map(|_| light(input)).collect::<Result<Vec<_>>>()?;
    let radiance = Rgb::splat(0.5);
    let environment = (sky & 1 > 0).then_some(Environment::uniform(radiance));
    // Off the planes of surfaces, in which the textbook has no density of a splat.
    let eye = Vec3::from(place(input)?) + Vec3::new(0.0077, 0.0029, 0.0113);
    let mut camera = Camera::look_at(eye, Vec3::from(place(input)?), Vec3::Y, 70.0);
    if sky & 2 > 0 {
        camera.lens_radius = 0.1;
    }
    let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
    let scene = Scene { mesh, materials: &materials, textures: &[], lights: &lights, environment, camera };

    let mut memory = lines(Bvh::footprint(triangles.len()));
    let bvh = Bvh::build(&scene.mesh, &mut arena(&mut memory)).expect("the footprint was granted");
    let mut memory = lines(LightSampler::footprint(&scene).and(LightSampler::scratch(&scene)));
    let lights = LightSampler::build(&scene, &mut arena(&mut memory)).expect("the footprint was granted");
    let [width, height, depth] = input.arbitrary::<[u8; 3]>()?;
    let settings = PathSettings {
        width: 1 + u32::from(width) % 20,
        height: 1 + u32::from(height) % 20,
        seed: input.arbitrary()?,
        max_depth: 1 + u32::from(depth) % 12,
    };
    work(input, &scene, &bvh, &lights, settings)
}

/// The highest or the lowest instruction set.
pub(crate) fn level(input: &mut Unstructured) -> Result<Level> {
    Ok(if input.arbitrary()? { Level::detect() } else { Level::BASELINE })
}

/// Memory of `footprint`, filled with a pattern.
pub(crate) fn lines(footprint: Footprint) -> Vec<Line> {
    vec![Line([0x5a; 64]); footprint.bytes() / 64]
}

/// An arena over `lines`.
pub(crate) fn arena(lines: &mut [Line]) -> Arena<'_> {
    Arena::over(lines)
}

/// A point in the room or near it, on a coarse grid.
fn place(input: &mut Unstructured) -> Result<[f32; 3]> {
    Ok(input.arbitrary::<[u8; 3]>()?.map(|x| f32::from(x % 32) / 12.0 - 0.3))
}

/// Offset of lights from the grid of corners, in no direction that two corners have.
const OFF_PLANES: Vec3 = Vec3::new(0.0131, 0.0177, 0.0073);

fn light(input: &mut Unstructured) -> Result<PointLight> {
    // Off the planes of surfaces, where the irradiance would be infinite.
    let (position, towards) = (Vec3::from(place(input)?) + OFF_PLANES, Vec3::from(place(input)?));
    let direction = (towards - position).normalize_or(Vec3::NEG_Y);
    let intensity = Rgb::splat([1.0, 0.0, 1e10, 1e-10][usize::from(input.arbitrary::<u8>()? % 4)]);
    Ok(match input.arbitrary::<u8>()? % 3 {
        0 => PointLight::Point { position, intensity },
        1 => PointLight::Spot { position, direction, intensity, cos_inner: 0.9, cos_outer: 0.7 },
        _ => PointLight::Directional { direction, irradiance: intensity },
    })
}

const MATERIALS: usize = 11;

fn materials() -> [Material; MATERIALS] {
    let of = |surface| Material { surface, ..Material::GREY };
    let glass =
        |roughness: f32| Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: roughness.into() };
    let metal = |roughness: f32| Surface::Conductor {
        reflectance: Rgb::splat(0.9).into(),
        roughness: roughness.into(),
    };
    let coat = |roughness: f32| Surface::Glossy {
        base: Rgb::splat(0.4).into(),
        specular: Rgb::splat(0.04).into(),
        roughness: roughness.into(),
        metallic: 0.0.into(),
        ior: Some(1.5),
    };
    let lamp = |radiance: f32, two_sided, opacity: f32| {
        let mut lamp = Material { two_sided, opacity: opacity.into(), ..Material::GREY };
        lamp.emission.value = Rgb::splat(radiance);
        lamp
    };
    [
        Material::GREY,
        lamp(1.0, false, 1.0),
        lamp(1e6, true, 0.5),
        of(glass(0.0)),
        of(glass(0.3)),
        of(metal(0.0)),
        of(metal(0.3)),
        of(coat(0.0)),
        of(coat(0.2)),
        Material { opacity: 0.5.into(), ..Material::GREY },
        of(Surface::Pane { ior: 1.5, tint: Rgb::new(0.9, 0.6, 0.3) }),
    ]
}
