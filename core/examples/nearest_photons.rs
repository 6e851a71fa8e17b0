//! Photon search alone: a kd-tree over points with a power, the nearest of them, and irradiance by density.
use halflight_core::glam::Vec3;
use halflight_core::memory::OutOfMemory;
use halflight_core::parts::photons::{Kernel, Neighbours, Photon, Photons, QueryDisc, Uniform};
use halflight_core::{Arena, Level, Line, Rgb};

fn main() -> Result<(), OutOfMemory> {
    let mut memory = vec![Line::ZERO; 6000];
    let mut arena = Arena::over(&mut memory);
    // 100 × 100 photons of 1 W together on a square of 1 m².
    let mut photons = Photons::new(10_000, &mut arena)?;
    for (i, photon) in photons.as_mut_slice().iter_mut().enumerate() {
        let position = Vec3::new((i % 100) as f32 / 100.0, 0.0, (i / 100) as f32 / 100.0);
        *photon = Photon::new(position, Vec3::Y, Vec3::Y, Rgb::splat(1e-4));
    }
    let map = photons.build(10_000);
    let (level, place) = (Level::detect(), Vec3::new(0.501, 0.0, 0.502));
    let mut neighbours = Neighbours::new(8, &mut arena)?;
    map.nearest(level, place, f32::INFINITY, &mut neighbours);
    for (index, squared_distance) in neighbours.iter() {
        println!("photon {index}, {:.4} m away", squared_distance.sqrt());
    }
    let disc = QueryDisc { place, normal: Vec3::Y, radius: 0.2, kernel: Kernel::Epanechnikov };
    let density = map.gather(level, &disc, &Uniform(Rgb::ONE));
    println!("{:.3} W/m² from {} photons", density.radiance.x, density.photons);
    Ok(())
}
