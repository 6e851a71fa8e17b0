//! Light sampling for any lamps and any lit points: all levels choose the same light with the same
//! probability; densities and radiance are neither negative nor NaN.

use crate::numbers::{fraction, traceable_point as point};
use arbitrary::{Result, Unstructured};
use glam::Vec3;
use halflight_core::light::LightSampler;
use halflight_core::memory::{Arena, Line};
use halflight_core::sampling::warp::uniform_sphere;
use halflight_core::scene::PointLight;
use halflight_core::scene::{Camera, Material, Mesh, Scene, Triangle};
use halflight_core::{Level, Rgb};

const MAX_POINTS: usize = 16;

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    let [vertices, triangles, points] = input.arbitrary::<[u8; 3]>()?;
    let positions = (0..1 + vertices % 64).map(|_| point(input)).collect::<Result<Vec<_>>>()?;
    let corner = |v: u8| u32::from(v) % positions.len() as u32;
    let triangles = (0..triangles % 64)
        .map(|_| {
            let [a, b, c, material] = input.arbitrary::<[u8; 4]>()?;
            Ok(Triangle { vertices: [a, b, c].map(corner), material: u32::from(material % 4) })
        })
        .collect::<Result<Vec<_>>>()?;
    let lamp = |radiance: f32, two_sided| {
        let mut material = Material { two_sided, ..Material::GREY };
        material.emission.value = Rgb::splat(radiance);
        material
    };
    let materials = [Material::GREY, lamp(1.0, false), lamp(1e10, true), lamp(1e-10, false)];
    let lights = (0..points % 8)
        .map(|_| Ok(PointLight::Point { position: point(input)?.into(), intensity: Rgb::ONE }))
        .collect::<Result<Vec<_>>>()?;
    let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
    let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 40.0);
    let scene =
        Scene { mesh, materials: &materials, textures: &[], lights: &lights, environment: None, camera };

    let bytes = LightSampler::footprint(&scene).and(LightSampler::scratch(&scene)).bytes();
    let mut lines = vec![Line([0; 64]); bytes / 64];
    let built = LightSampler::build(&scene, &mut Arena::over(&mut lines));
    let lights = built.expect("the footprint is what the build takes");
    for _ in 0..MAX_POINTS {
        if input.is_empty() {
            break;
        }
        let position = Vec3::from(point(input)?);
        let u = [fraction(input)?, fraction(input)?, fraction(input)?];
        let faces = input.arbitrary::<bool>()?;
        let normal = if faces { uniform_sphere([fraction(input)?, fraction(input)?]) } else { Vec3::ZERO };
        let found = lights.with_level(Level::BASELINE).sample(&scene, position, normal, u);
        if let Some(sample) = &found {
            assert!(
                sample.pdf >= 0.0 && sample.radiance.min_element() >= 0.0,
                "{position} {normal}: {sample:?}"
            );
        }
        for level in Level::detect().and_below() {
            let same = lights.with_level(level).sample(&scene, position, normal, u);
            assert_eq!(same, found, "{} at {position}, {normal}", level.name());
        }
    }
    Ok(())
}
