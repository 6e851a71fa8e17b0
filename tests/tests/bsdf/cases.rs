//! BSDFs under test, and directions of their viewers.

use glam::{Vec2, Vec3};
use halflight_core::Rgb;
use halflight_core::bsdf::{All, Bsdf, BsdfSample};
use halflight_core::sampling::Random;
use halflight_core::scene::Camera;
use halflight_core::scene::{Attributes, ColorInput, Material, Mesh, ScalarInput, Scene, Surface};

/// A scene without meshes, lights and textures.
pub(crate) fn empty_scene() -> Scene<'static> {
    Scene {
        mesh: Mesh::default(),
        materials: &[],
        textures: &[],
        lights: &[],
        environment: None,
        camera: Camera::look_at(Vec3::ZERO, Vec3::X, Vec3::Z, 40.0),
    }
}

pub(crate) fn resolve(surface: Surface, front: bool) -> Bsdf {
    let material = Material { surface, ..Material::GREY };
    Bsdf::at::<All>(&empty_scene(), &material, &Attributes::of_uv(Vec2::splat(0.5)), front)
}

/// Input `roughness` whose square is `alpha`.
fn rough(alpha: f32) -> ScalarInput {
    alpha.sqrt().into()
}

pub(crate) fn conductor(f0: Rgb, alpha: f32) -> Bsdf {
    resolve(Surface::Conductor { reflectance: f0.into(), roughness: rough(alpha) }, true)
}

pub(crate) fn coated(base: Rgb, specular: Rgb, alpha: f32, metallic: f32, ior: Option<f32>) -> Bsdf {
    let (base, specular): (ColorInput, ColorInput) = (base.into(), specular.into());
    let surface = Surface::Glossy { base, specular, roughness: rough(alpha), metallic: metallic.into(), ior };
    resolve(surface, true)
}

pub(crate) fn plastic(base: Rgb, alpha: f32, ior: f32) -> Bsdf {
    let r = (ior - 1.0) / (ior + 1.0);
    coated(base, Rgb::splat(r * r), alpha, 0.0, Some(ior))
}

pub(crate) fn dielectric(ior: f32, tint: Rgb, alpha: f32, front: bool) -> Bsdf {
    resolve(Surface::Dielectric { ior, tint, roughness: rough(alpha) }, front)
}

/// BSDFs of all kinds that scatter, from both sides.
pub(crate) fn scattering() -> Vec<(String, Bsdf)> {
    let mut all = vec![(
        "diffuse".to_string(),
        resolve(Surface::Diffuse { reflectance: Rgb::new(0.2, 0.9, 1.0).into() }, true),
    )];
    for alpha in [1e-4, 1e-3, 0.02, 0.1, 0.4, 1.0] {
        all.push((format!("conductor {alpha}"), conductor(Rgb::new(1.0, 0.6, 0.2), alpha)));
        for (ior, front) in [(1.5, true), (1.5, false), (1.1, false), (2.4, true)] {
            all.push((format!("glass {alpha} {ior} {front}"), dielectric(ior, Rgb::ONE, alpha, front)));
        }
    }
    for alpha in [0.0, 1e-3, 0.1, 0.5, 1.0] {
        let (base, specular) = (Rgb::new(0.9, 0.5, 0.1), Rgb::new(0.04, 0.2, 0.5));
        all.push((format!("glossy {alpha}"), coated(base, specular, alpha, 0.0, None)));
        all.push((format!("half metal {alpha}"), coated(base, specular, alpha, 0.5, None)));
        all.push((format!("plastic {alpha}"), plastic(base, alpha, 1.5)));
        all.push((
            format!("metallic plastic {alpha}"),
            coated(base, Rgb::splat(0.04), alpha, 0.5, Some(1.5)),
        ));
    }
    all
}

/// Cosines of `wo`.
pub(crate) const VIEWS: [f32; 5] = [1.0, 0.8, 0.4, 0.1, 0.01];

/// Unit direction of cosine `c`, off the coordinate axes except at normal incidence.
pub(crate) fn view(c: f32) -> Vec3 {
    let sin = (1.0 - c * c).sqrt();
    Vec3::new(0.8 * sin, -0.6 * sin, c)
}

/// Sample `i` of a stream.
pub(crate) fn draw(bsdf: &Bsdf, wo: Vec3, random: &Random, i: u32) -> Option<BsdfSample> {
    bsdf.sample::<All>(wo, [random.single(3 * i), random.single(3 * i + 1), random.single(3 * i + 2)])
}
