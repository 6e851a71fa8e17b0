//! What it costs to shade: nanoseconds per `sample` and per `evaluate` of each BSDF, on one thread.
//!
//! `cargo run --release -p halflight-tests --example bsdf_timings`

use core::f32::consts::TAU;
use core::hint::black_box;
use glam::Vec3;
use halflight_core::Rgb;
use halflight_core::bsdf::{All, Bsdf, DiffuseOnly, Features};
use halflight_core::sampling::Random;
use halflight_core::scene::Camera;
use halflight_core::scene::{Attributes, Material, Mesh, Scene, Surface};
use std::time::Instant;

const CALLS: usize = 4096;
const ROUNDS: usize = 500;

fn main() {
    let color = Rgb::new(0.7, 0.5, 0.3);
    let glossy = |roughness: f32, ior| Surface::Glossy {
        base: color.into(),
        specular: Rgb::splat(0.04).into(),
        roughness: roughness.into(),
        metallic: 0.0.into(),
        ior,
    };
    let glass =
        |roughness: f32| Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: roughness.into() };
    println!("{:24} {:>8} {:>8} {:>8}  ns", "", "at", "sample", "evaluate");
    let diffuse = Surface::Diffuse { reflectance: color.into() };
    time::<DiffuseOnly>("diffuse, nothing else", diffuse);
    for (name, surface) in [
        ("diffuse", diffuse),
        ("mirror", Surface::Mirror { reflectance: color.into() }),
        ("conductor 0.1", Surface::Conductor { reflectance: color.into(), roughness: 0.316.into() }),
        ("glossy 0", glossy(0.0, None)),
        ("glossy 0.1", glossy(0.316, None)),
        ("plastic 0", glossy(0.0, Some(1.5))),
        ("plastic 0.1", glossy(0.316, Some(1.5))),
        ("glass", glass(0.0)),
        ("glass 0.1", glass(0.316)),
    ] {
        time::<All>(name, surface);
    }
}

/// Viewer, light, random numbers.
type Input = (Vec3, Vec3, [f32; 3]);

fn time<F: Features>(name: &str, surface: Surface) {
    let material = Material { surface, ..Material::GREY };
    let camera = Camera::look_at(Vec3::ZERO, Vec3::X, Vec3::Z, 40.0);
    let scene = Scene {
        mesh: Mesh::default(),
        materials: &[],
        textures: &[],
        lights: &[],
        environment: None,
        camera,
    };
    let random = Random::new(1, 2);
    let inputs: Vec<Input> = (0..CALLS as u32)
        .map(|i| {
            let u = |j: u32| random.single(7 * i + j);
            let direction = |c: f32, turn: f32| {
                let sin = (1.0 - c * c).sqrt();
                Vec3::new(sin * (TAU * turn).cos(), sin * (TAU * turn).sin(), c)
            };
            (direction(1.0 - 0.99 * u(0), u(1)), direction(1.0 - 0.99 * u(2), u(3)), [u(4), u(5), u(6)])
        })
        .collect();
    let at = || Bsdf::at::<F>(&scene, black_box(&material), &Attributes::NONE, true);
    let bsdf = black_box(at());
    let nanoseconds = |f: &dyn Fn(&Input) -> f32| {
        let mut best = f64::INFINITY;
        for _ in 0..5 {
            let start = Instant::now();
            for _ in 0..ROUNDS / 5 {
                black_box(inputs.iter().map(f).sum::<f32>());
            }
            best = best.min(start.elapsed().as_secs_f64() * 1e9 / (CALLS * ROUNDS / 5) as f64);
        }
        best
    };
    println!(
        "{name:24} {:8.1} {:8.1} {:8.1}",
        nanoseconds(&|_| if at().is_delta() { 1.0 } else { 0.0 }),
        nanoseconds(&|(wo, _, u)| bsdf
            .sample::<F>(*wo, *u)
            .map_or(0.0, |s| s.weight.x + s.direction.x + s.pdf)),
        nanoseconds(&|(wo, wi, _)| {
            let (value, pdf) = bsdf.evaluate::<F>(*wo, *wi);
            value.x + pdf
        }),
    );
}
