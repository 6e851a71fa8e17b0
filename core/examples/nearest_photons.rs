//! Photon search alone: a kd-tree over points with a power, the nearest of them, and the density of power
//! around a place. No heap, and nothing of the renderer.
use glam::Vec3;
use halflight_core::memory::{Arena, Footprint, Line, OutOfMemory};
use halflight_core::photon::{Kernel, Neighbours, Photon, Photons, QueryDisc, Uniform};
use halflight_core::sampling::Random;
use halflight_core::{Level, Rgb};

/// Photons on a square of 1 m², of 1 W together.
const PHOTONS: usize = 10_000;
/// Neighbours per search.
const NEAREST: usize = 8;
const LINES: usize = 6000;

fn main() -> Result<(), OutOfMemory> {
    let mut memory = vec![Line([0; 64]); LINES];
    let needed: Footprint = Photons::footprint(PHOTONS).and(Neighbours::footprint(NEAREST));
    assert!(needed.bytes() <= LINES * 64, "{} lines", needed.bytes() / 64);
    let mut arena = Arena::over(&mut memory);

    let mut photons = Photons::new(PHOTONS, &mut arena)?;
    for (i, photon) in photons.as_mut_slice().iter_mut().enumerate() {
        let random = Random::new(0, i as u32);
        let position = Vec3::new(random.single(0), 0.0, random.single(1));
        *photon = Photon::new(position, Vec3::Y, Vec3::Y, Rgb::splat(1.0 / PHOTONS as f32));
    }
    let map = photons.build(PHOTONS);

    let (level, place) = (Level::detect(), Vec3::new(0.5, 0.0, 0.5));
    let mut neighbours = Neighbours::new(NEAREST, &mut arena)?;
    map.nearest(level, place, f32::INFINITY, &mut neighbours);
    for (index, squared_distance) in neighbours.iter() {
        let position = map.get(index).map(|photon| photon.position());
        println!("photon {index} at {position:?}, {:.4} m away", squared_distance.sqrt());
    }

    // Irradiance, 1 W/m²: a response of one makes it of the density of power.
    let disc = QueryDisc { place, normal: Vec3::Y, radius: 0.2, kernel: Kernel::Epanechnikov };
    let density = map.gather(level, &disc, &Uniform(Rgb::ONE));
    println!("{:.3} W/m² from {} photons", density.radiance.x, density.photons);
    Ok(())
}
