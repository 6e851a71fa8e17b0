//! The latitude-longitude map of a sky.

use super::Dome;
use core::f64::consts::{PI, TAU};
use glam::DVec3;
use rayon::prelude::*;

/// Columns and rows: 0.35 degrees each. The horizon lies between two rows.
pub const SIZE: [u32; 2] = [1024, 512];

/// Bytes of [`map`].
pub const BYTES: usize = SIZE[0] as usize * SIZE[1] as usize * size_of::<[f32; 3]>();

/// Texels of the sky, row by row from the zenith (+y of the map), with the sun in the unit direction `sun` of
/// the map.
pub fn map(dome: &Dome, sun: DVec3) -> Vec<[f32; 3]> {
    let [width, height] = SIZE.map(|side| side as usize);
    let texel = |i: usize| {
        let theta = PI * ((i / width) as f64 + 0.5) / height as f64;
        let phi = TAU * ((i % width) as f64 + 0.5) / width as f64;
        let direction = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        let gamma = direction.dot(sun).clamp(-1.0, 1.0).acos();
        dome.radiance(theta, gamma).map(|channel| channel as f32)
    };
    (0..width * height).into_par_iter().map(texel).collect()
}
