//! Rays, nearest photons and irradiance at points, each in the same 256 KiB: no heap, no threads.
//! `cargo verify targets` runs this very file without libc, as WebAssembly and for Cortex-M: same bits.
#[path = "room/mod.rs"]
pub mod room;

use halflight_core::glam::Vec3;
use halflight_core::memory::OutOfMemory;
use halflight_core::parts::irradiance::IrradianceSampler;
use halflight_core::parts::photons::{Kernel, Neighbours, Photon, Photons, QueryDisc, Uniform};
use halflight_core::parts::rays::{Bvh, Ray};
use halflight_core::{Arena, Level, Line, Rgb};

/// Cache lines that each part has.
pub const LINES: usize = 1 << 12;
/// Values of a part.
pub const COUNT: usize = 256;
/// Computes the values of a part in the given memory.
pub type Part = fn(&mut [Line], &mut [Rgb]) -> Result<(), OutOfMemory>;
/// All parts.
pub const PARTS: [(&str, Part); 3] = [("rays", rays), ("photons", photons), ("irradiance", irradiance)];

/// A ray from below the lamp to the floor or the pyramid, on a grid of 16 × 16.
fn down(i: usize) -> Ray {
    let at = |i: usize| ((i as f32 + 0.5) / 16.0 - 0.5) * 3.9;
    Ray::new(Vec3::new(at(i % 16), 2.5, at(i / 16)), Vec3::NEG_Y)
}

/// Distance, triangle, and whether something hides the lamp.
pub fn rays(memory: &mut [Line], values: &mut [Rgb]) -> Result<(), OutOfMemory> {
    let scene = room::scene();
    let bvh = Bvh::build(&scene.mesh, &mut Arena::over(memory))?;
    for (i, value) in values.iter_mut().enumerate() {
        let ray = down(i);
        let hit = bvh.nearest(Level::BASELINE, &ray);
        let place = ray.at(0.99 * hit.t);
        let is_dark =
            bvh.occluded(Level::BASELINE, &Ray::segment(place, Vec3::new(0.1, 2.8, -0.1) - place, 1.0));
        *value = Rgb::new(hit.t, hit.triangle as f32, f32::from(u8::from(is_dark)));
    }
    Ok(())
}

/// Mean squared distance of the eight nearest photons, the farthest, and irradiance by density.
pub fn photons(memory: &mut [Line], values: &mut [Rgb]) -> Result<(), OutOfMemory> {
    let mut arena = Arena::over(memory);
    let mut photons = Photons::new(2048, &mut arena)?;
    for (i, photon) in photons.as_mut_slice().iter_mut().enumerate() {
        let position = Vec3::new(i as f32 / 2048.0, 0.0, (i * 789 % 2048) as f32 / 2048.0);
        *photon = Photon::new(position, Vec3::Y, Vec3::Y, Rgb::splat(1.0 / 2048.0));
    }
    let map = photons.build(2048);
    let mut neighbours = Neighbours::new(8, &mut arena)?;
    for (i, value) in values.iter_mut().enumerate() {
        let place = Vec3::new((i % 16) as f32 / 16.0, 0.0, (i / 16) as f32 / 16.0);
        map.nearest(Level::BASELINE, place, f32::INFINITY, &mut neighbours);
        let distances = || neighbours.iter().map(|(_, squared)| squared);
        let disc = QueryDisc { place, normal: Vec3::Y, radius: 0.1, kernel: Kernel::Epanechnikov };
        let density = map.gather(Level::BASELINE, &disc, &Uniform(Rgb::ONE)).radiance;
        *value = Rgb::new(distances().sum::<f32>() / 8.0, distances().fold(0.0, f32::max), density.x);
    }
    Ok(())
}

/// Irradiance by sixteen paths.
pub fn irradiance(memory: &mut [Line], values: &mut [Rgb]) -> Result<(), OutOfMemory> {
    let scene = room::scene();
    let sampler = IrradianceSampler::new(&scene, &mut Arena::over(memory))?;
    for (i, value) in values.iter_mut().enumerate() {
        *value = sampler.irradiance(&down(i), i as u32, 16).map_or(Rgb::ZERO, |found| found.mean);
    }
    Ok(())
}

fn main() {
    let (mut memory, mut values) = (vec![Line::ZERO; LINES], [Rgb::ZERO; COUNT]);
    for (name, part) in PARTS {
        part(&mut memory, &mut values).expect("LINES is enough");
        let mean = values.iter().sum::<Rgb>() / COUNT as f32;
        println!("{name} {mean:.4}\n{:016x}", room::fingerprint(&values));
    }
}
