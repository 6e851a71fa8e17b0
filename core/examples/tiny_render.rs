//! A path-traced picture in a fixed buffer (a `static` on a microcontroller): no heap, no threads, and no
//! operating system but for the printing. `cargo verify targets` runs this very file without libc, as
//! WebAssembly and for Cortex-M: same bits everywhere.
use glam::Vec3;
use halflight_core::bsdf::DiffuseOnly;
use halflight_core::bvh::Bvh;
use halflight_core::film::{Film, PIXELS_PER_TILE};
use halflight_core::light::LightSampler;
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::scene::{Camera, Material, Mesh, Scene, Triangle};
use halflight_core::transport::{PathIntegrator, PathSettings};
use halflight_core::{Level, Rgb};

/// Pixels across and down.
pub const SIZE: usize = 32;
/// Cache lines that all structures take together.
pub const LINES: usize = 2048;
const PATHS: u32 = 8;

#[rustfmt::skip]
const POSITIONS: [[f32; 3]; 15] = [
    [-2.0, 0.0, -2.0], [2.0, 0.0, -2.0], [2.0, 0.0, 2.0], [-2.0, 0.0, 2.0], [-2.0, 3.0, -2.0], [2.0, 3.0, -2.0],
    [2.0, 3.0, 2.0], [-2.0, 3.0, 2.0], [-1.0, 0.0, 0.9], [1.0, 0.0, 0.9], [0.0, 0.0, -0.8], [0.0, 1.6, 0.3],
    [-0.6, 2.9, -0.6], [0.6, 2.9, -0.6], [0.0, 2.9, 0.6],
];
/// Floor, back, left and right wall, ceiling, pyramid, lamp.
#[rustfmt::skip]
const TRIANGLES: [Triangle; 14] = [
    face(0, 2, 1, 0), face(0, 3, 2, 0), face(0, 1, 5, 0), face(0, 5, 4, 0), face(0, 4, 7, 1), face(0, 7, 3, 1),
    face(1, 2, 6, 2), face(1, 6, 5, 2), face(4, 5, 6, 0), face(4, 6, 7, 0), face(8, 9, 11, 0), face(9, 10, 11, 0),
    face(10, 8, 11, 0), face(12, 13, 14, 3),
];

const fn face(a: u32, b: u32, c: u32, material: u32) -> Triangle {
    Triangle { vertices: [a, b, c], material }
}

/// Renders a pyramid in a room into `pixels`, row by row from the top, with all structures in `memory`.
pub fn render(memory: &mut [Line; LINES], pixels: &mut [Rgb; SIZE * SIZE]) -> Result<(), OutOfMemory> {
    let [white, red, green] =
        [Rgb::splat(0.7), Rgb::new(0.7, 0.1, 0.1), Rgb::new(0.1, 0.6, 0.1)].map(Material::diffuse);
    let lamp = Material { emission: Rgb::splat(20.0).into(), ..white };
    let scene = Scene {
        mesh: Mesh { positions: &POSITIONS, triangles: &TRIANGLES, ..Mesh::default() },
        materials: &[white, red, green, lamp],
        textures: &[],
        lights: &[],
        environment: None,
        camera: Camera::look_at(Vec3::new(0.0, 1.5, 6.5), Vec3::new(0.0, 1.4, 0.0), Vec3::Y, 40.0),
    };
    let mut arena = Arena::new(bytemuck::cast_slice_mut(memory));
    let bvh = Bvh::build(&scene.mesh, &mut arena)?;
    let lights = LightSampler::build(&scene, &mut arena)?;
    let mut film = Film::new(SIZE as u32, SIZE as u32, &mut arena)?;
    let settings = PathSettings { width: SIZE as u32, height: SIZE as u32, seed: 1, max_depth: 8 };
    let tracer =
        PathIntegrator::<DiffuseOnly>::new(&scene, &bvh, &lights, settings, Level::BASELINE).with_reuse();
    for (task, tile) in film.pixels_mut().chunks_mut(PIXELS_PER_TILE).enumerate() {
        tracer.run(task, 0..PATHS, 64, &mut arena, tile)?;
    }
    for (i, pixel) in pixels.iter_mut().enumerate() {
        *pixel = film.mean((i % SIZE) as u32, (i / SIZE) as u32);
    }
    Ok(())
}

/// FNV-1a over the bits of the picture.
pub fn fingerprint(pixels: &[Rgb]) -> u64 {
    let bytes = pixels.iter().flat_map(|p| p.to_array()).flat_map(|v| v.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

fn main() {
    let (mut memory, mut pixels) = ([Line([0; 64]); LINES], [Rgb::ZERO; SIZE * SIZE]);
    render(&mut memory, &mut pixels).expect("LINES is enough");
    for row in pixels.chunks(SIZE).step_by(2) {
        row.iter().for_each(|p| print!("{}", char::from(b" .:-=+*#%@"[(12.0 * p.y).min(9.0) as usize])));
        println!();
    }
    println!("{:016x}", fingerprint(&pixels));
}
