//! A picture from a static buffer: no heap, no threads, no operating system but for the printing.
//! The checks build this file for Cortex-M and run it as WebAssembly and without libc: same bits everywhere.
use glam::Vec3;
use halflight_core::bvh::Bvh;
use halflight_core::geometry::Ray;
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::scene::{Mesh, Triangle};
use halflight_core::{Level, Rgb};

/// Pixels across and down.
pub const SIZE: usize = 32;
/// Cache lines that the structures take.
pub const LINES: usize = 64;
const PATHS: u32 = 4;

const POSITIONS: [[f32; 3]; 8] = [
    [-4.0, 0.0, -4.0],
    [4.0, 0.0, -4.0],
    [4.0, 0.0, 4.0],
    [-4.0, 0.0, 4.0],
    [-1.0, 0.0, 0.8],
    [1.0, 0.0, 0.8],
    [0.0, 0.0, -1.0],
    [0.0, 1.6, 0.2],
];
const TRIANGLES: [Triangle; 5] = [face(0, 2, 1), face(0, 3, 2), face(4, 5, 7), face(5, 6, 7), face(6, 4, 7)];

const fn face(a: u32, b: u32, c: u32) -> Triangle {
    Triangle { vertices: [a, b, c], material: 0 }
}

/// Renders a white pyramid on a floor under a white sky into `pixels`, row by row from the top.
pub fn render(memory: &mut [Line; LINES], pixels: &mut [Rgb; SIZE * SIZE]) -> Result<(), OutOfMemory> {
    let mut arena = Arena::new(bytemuck::cast_slice_mut(memory));
    let mesh = Mesh { positions: &POSITIONS, triangles: &TRIANGLES, ..Mesh::default() };
    let bvh = Bvh::build(&mesh, &mut arena)?;
    for (pixel, out) in pixels.iter_mut().enumerate() {
        let (x, y) = ((pixel % SIZE) as f32, (pixel / SIZE) as f32);
        let direction = Vec3::new((x - 15.5) / 16.0, (15.5 - y) / 16.0 - 0.2, -2.0);
        let mut random = pixel as u32 + 1;
        let light: f32 = (0..PATHS).map(|_| path(&mesh, &bvh, direction, &mut random)).sum();
        *out = Rgb::splat(light / PATHS as f32);
    }
    Ok(())
}

/// What one path brings back from the sky: half of it is lost at every bounce.
fn path(mesh: &Mesh, bvh: &Bvh, direction: Vec3, random: &mut u32) -> f32 {
    let mut ray = Ray::new(Vec3::new(0.0, 1.2, 5.0), direction);
    for bounce in 0..8 {
        let hit = bvh.nearest(Level::BASELINE, &ray);
        if !hit.is_some() {
            return sky_after(bounce);
        }
        let [a, b, c] = mesh.corners(hit.triangle);
        let normal = (b - a).cross(c - a).normalize();
        let [x, y, z] = core::array::from_fn(|_| 2.0 * uniform(random) - 1.0);
        ray = Ray::new(ray.at(hit.t) + 1e-4 * normal, normal + 0.9 * Vec3::new(x, y, z).normalize_or_zero());
    }
    0.0
}

fn sky_after(bounce: u32) -> f32 {
    1.0 / (1u32 << bounce) as f32
}

fn uniform(state: &mut u32) -> f32 {
    *state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    (*state >> 8) as f32 / (1u32 << 24) as f32
}

/// FNV-1a over the bits of the picture.
pub fn fingerprint(pixels: &[Rgb]) -> u64 {
    let bytes = pixels.iter().flat_map(|p| p.to_array()).flat_map(|v| v.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

fn main() {
    let (mut memory, mut pixels) = ([Line([0; 64]); LINES], [Rgb::ZERO; SIZE * SIZE]);
    if let Err(error) = render(&mut memory, &mut pixels) {
        return println!("{error}");
    }
    for row in pixels.chunks(SIZE).step_by(2) {
        row.iter().for_each(|p| print!("{}", char::from(b" .:-=+*#%@"[(p.x * 9.0).min(9.0) as usize])));
        println!();
    }
    println!("{:016x}", fingerprint(&pixels));
}
