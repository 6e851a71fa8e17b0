//! Irradiance at given points, as light maps want it, with its standard error.
#[path = "room/mod.rs"]
mod room;

use halflight_core::glam::Vec3;
use halflight_core::memory::OutOfMemory;
use halflight_core::parts::irradiance::IrradianceSampler;
use halflight_core::parts::rays::Ray;
use halflight_core::{Arena, Line};

fn main() -> Result<(), OutOfMemory> {
    let scene = room::scene();
    let mut memory = vec![Line::ZERO; Line::count(IrradianceSampler::required_memory(&scene))];
    let sampler = IrradianceSampler::new(&scene, &mut Arena::over(&mut memory))?;
    for texel in 0..64 {
        // A ray down finds the surface, and with it the bound of its rounding error.
        let at = |i: u32| ((i as f32 + 0.5) / 8.0 - 0.5) * 3.9;
        let down = Ray::new(Vec3::new(at(texel % 8), 0.5, at(texel / 8)), Vec3::NEG_Y);
        let Some(found) = sampler.irradiance(&down, texel, 256) else { continue };
        let end = if texel % 8 == 7 { "\n" } else { "" };
        print!("{:6.2}±{:.2}{end}", found.mean.y, found.standard_error.y);
    }
    Ok(())
}
