//! Irradiance at given points, as light maps want it: the mean of what path tracing finds at each point, and
//! its standard error. All structures are in one buffer.
#[path = "room/mod.rs"]
mod room;

use glam::Vec3;
use halflight_core::Rgb;
use halflight_core::bsdf::DiffuseOnly;
use halflight_core::bvh::Bvh;
use halflight_core::geometry::Ray;
use halflight_core::light::LightSampler;
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::sampling::Sampler;
use halflight_core::scene::SurfacePoint;
use halflight_core::transport::UNLIMITED;
use halflight_core::transport::path::reference::irradiance;

/// Points along a side of the floor.
const SIDE: u32 = 8;
/// Paths of a point.
const PATHS: u32 = 256;

fn main() -> Result<(), OutOfMemory> {
    let mut memory = vec![Line([0; 64]); 256];
    let mut arena = Arena::over(&mut memory);
    let scene = room::scene();
    let bvh = Bvh::build(&scene.mesh, &mut arena)?;
    let lights = LightSampler::build(&scene, &mut arena)?;
    let level = halflight_core::Level::detect();

    println!("irradiance of the floor, W/m², and its standard error");
    for texel in 0..SIDE * SIDE {
        // A ray down finds the surface, and with it the bound of its rounding error.
        let place = |i: u32| ((i as f32 + 0.5) / SIDE as f32 - 0.5) * 3.9;
        let down = Ray::new(Vec3::new(place(texel % SIDE), 0.5, place(texel / SIDE)), Vec3::NEG_Y);
        let hit = bvh.nearest(level, &down);
        let Some(point) = SurfacePoint::at::<DiffuseOnly>(&scene, &down, &hit) else { continue };

        let (mut sum, mut squares) = (Rgb::ZERO, 0.0);
        for path in 0..PATHS {
            let sampler = Sampler::new(1, texel, path);
            let sample = irradiance(&scene, &bvh, &lights, UNLIMITED, &sampler, &point);
            sum += sample;
            squares += sample.y * sample.y;
        }
        let mean = sum / PATHS as f32;
        let error = ((squares / PATHS as f32 - mean.y * mean.y) / PATHS as f32).sqrt();
        print!("{:6.2}±{error:.2}{}", mean.y, if texel % SIDE == SIDE - 1 { "\n" } else { "" });
    }
    Ok(())
}
