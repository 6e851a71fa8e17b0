//! A room with its lightmap, and a sphere lit by an irradiance volume. Run it in this folder, after
//!
//!     halflight bake ../room.toml --lightmap all --size 256x192 --unit white -o assets/map.exr
//!     halflight bake ../room.toml --probes 6x6x6 --box=-1,0,-1,1,2,1 -o assets/probes.ktx2
//!
//! An argument is the name of a PFM file, which gets a picture of 300 x 300 pixels without a window; `room`
//! after it leaves the sphere out.

mod picture;

use bevy::asset::RenderAssetUsages;
use bevy::camera::Exposure;
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::light::{IrradianceVolume, LightProbe};
use bevy::mesh::PrimitiveTopology;
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use std::collections::BTreeMap;

/// Texels are radiances: the exposure of the camera and this factor are 1 together. Emission has no exposure.
const RADIANCE: f32 = 1.2;
const EV100: f32 = 0.0;

/// Box of the probes: its lowest corner and its sides.
const BOX: [Vec3; 2] = [Vec3::new(-1.0, 0.0, -1.0), Vec3::splat(2.0)];

/// Maps that a picture waits for.
#[derive(Resource)]
struct Maps([Handle<Image>; 2]);

fn main() {
    let mut app = App::new();
    match std::env::args().nth(1) {
        Some(file) => picture::add_plugins(&mut app, file.into()),
        None => {
            app.add_plugins(DefaultPlugins);
        }
    }
    // The default ambient light would be added to that of the maps.
    app.insert_resource(GlobalAmbientLight::NONE).add_systems(Startup, build).run();
}

fn build(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let [map, voxels]: [Handle<Image>; 2] = [assets.load("map.exr"), assets.load("probes.ktx2")];
    commands.insert_resource(Maps([map.clone(), voxels.clone()]));
    for (name, mesh) in rooms(include_str!("../../room.obj")) {
        let (base, emissive) = match name.as_str() {
            "red" => (Color::linear_rgb(0.6, 0.06, 0.05), LinearRgba::BLACK),
            "green" => (Color::linear_rgb(0.12, 0.45, 0.1), LinearRgba::BLACK),
            "lamp" => (Color::BLACK, LinearRgba::rgb(6.0, 5.4, 4.5)),
            _ => (Color::linear_rgb(0.7, 0.7, 0.7), LinearRgba::BLACK),
        };
        commands.spawn((
            Mesh3d(meshes.add(mesh)),
            MeshMaterial3d(materials.add(diffuse(base, emissive))),
            Lightmap { image: map.clone(), bicubic_sampling: false, ..default() },
        ));
    }
    let [low, sides] = BOX;
    commands.spawn((
        LightProbe::default(),
        IrradianceVolume { voxels, intensity: RADIANCE, affects_lightmapped_meshes: false },
        Transform::from_translation(low + 0.5 * sides).with_scale(sides),
    ));
    if std::env::args().nth(2).as_deref() != Some("room") {
        commands.spawn((
            Mesh3d(meshes.add(Sphere::new(0.3).mesh().uv(64, 32))),
            MeshMaterial3d(materials.add(diffuse(Color::linear_rgb(0.7, 0.7, 0.7), LinearRgba::BLACK))),
            Transform::from_xyz(0.5, 0.45, 0.25),
        ));
    }
    commands.spawn((
        Camera3d::default(),
        Exposure { ev100: EV100 },
        Tonemapping::None,
        Projection::Perspective(PerspectiveProjection { fov: 40_f32.to_radians(), ..default() }),
        Transform::from_xyz(0.0, 1.0, 3.6).looking_at(Vec3::new(0.0, 0.95, 0.0), Vec3::Y),
    ));
}

fn diffuse(base_color: Color, emissive: LinearRgba) -> StandardMaterial {
    StandardMaterial {
        base_color,
        emissive,
        perceptual_roughness: 1.0,
        reflectance: 0.0,
        lightmap_exposure: RADIANCE,
        ..default()
    }
}

/// The triangles of each material, with the texture coordinates of the lightmap. Their v goes down in Bevy.
fn rooms(text: &str) -> BTreeMap<String, Mesh> {
    let (mut positions, mut coordinates, mut material) = (Vec::new(), Vec::new(), String::new());
    let mut corners: BTreeMap<String, Vec<([f32; 3], [f32; 2])>> = BTreeMap::new();
    let number = |word: &str| word.parse::<f32>().unwrap_or_default();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["v", x, y, z] => positions.push([x, y, z].map(number)),
            ["vt", u, v] => coordinates.push([number(u), 1.0 - number(v)]),
            ["usemtl", name] => material = name.to_owned(),
            ["f", ref face @ ..] => {
                let corner = |word: &&str| {
                    let index = |part: usize| word.split('/').nth(part)?.parse::<usize>().ok();
                    Some((positions[index(0)? - 1], coordinates[index(1)? - 1]))
                };
                let face: Vec<_> = face.iter().filter_map(corner).collect();
                let fan = (2..face.len()).flat_map(|i| [face[0], face[i - 1], face[i]]);
                corners.entry(material.clone()).or_default().extend(fan);
            }
            _ => {}
        }
    }
    let mesh = |corners: Vec<([f32; 3], [f32; 2])>| {
        let (positions, coordinates): (Vec<_>, Vec<_>) = corners.into_iter().unzip();
        Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
            .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, coordinates.clone())
            .with_inserted_attribute(Mesh::ATTRIBUTE_UV_1, coordinates)
            .with_computed_flat_normals()
    };
    corners.into_iter().map(|(name, corners)| (name, mesh(corners))).collect()
}
