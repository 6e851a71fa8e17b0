//! A small picture by every method in one buffer, such as a `static` of a microcontroller: no heap, no
//! threads, and an operating system only to print. `cargo verify targets` runs this very file without
//! libc, as WebAssembly and for Cortex-M: same bits everywhere.
#[path = "room/mod.rs"]
mod room;

use halflight_core::bsdf::{DiffuseOnly, Only};
use halflight_core::bvh::Bvh;
use halflight_core::cache::irradiance::Metric;
use halflight_core::cache::radiance::LobeSettings;
use halflight_core::light::LightSampler;
use halflight_core::memory::{Arena, Buffer, Line, OutOfMemory};
use halflight_core::method::bidirectional::{Bidirectional, BidirectionalSettings};
use halflight_core::method::instant_radiosity::{InstantRadiosity, VirtualLightSettings};
use halflight_core::method::irradiance_cache::{CacheSettings, IrradianceCaching};
use halflight_core::method::metropolis::{Metropolis, MetropolisSettings};
use halflight_core::method::path::PathTracing;
use halflight_core::method::photon_map::PhotonMapping;
use halflight_core::method::sppm::ProgressivePhotonMapping;
use halflight_core::method::{
    Loop, Method, PhotonSettings, PilotSize, RenderContext, RenderState, Round, Shard,
};
use halflight_core::transport::{PathSettings, UNLIMITED};
use halflight_core::{Level, Rgb};

/// Pixels across and down.
pub const SIZE: usize = 32;
/// Methods by their names on the command line.
pub const METHODS: [&str; 10] = [
    "path",
    "light",
    "sppm",
    "bdpt",
    "photon-map",
    "vcm",
    "instant-radiosity",
    "mlt",
    "irradiance-cache",
    "radiance-cache",
];
/// Cache lines that all structures of any method take together.
pub const LINES: usize = 1 << 16;
/// Bytes of working memory at most.
const SCRATCH: usize = 640 << 10;

/// Kinds of surfaces of the room with a wall of metal.
type WithMetal = Only<false, true, false, false, false>;

/// Renders the room by method number `method` into `pixels`, row by row from the top, all structures in
/// `memory`.
pub fn render(
    method: usize,
    memory: &mut [Line],
    pixels: &mut [Rgb; SIZE * SIZE],
) -> Result<(), OutOfMemory> {
    let (mut scene, size) = (room::scene(), SIZE as u32);
    // Radiance records serve wide lobes.
    let lobes =
        (method == 9).then_some(LobeSettings { tolerance: 0.05, degree: 2, ..LobeSettings::default() });
    let materials = room::with_metal_wall();
    if lobes.is_some() {
        scene.materials = &materials;
    }
    let mut arena = Arena::over(memory);
    let bvh = Bvh::build(&scene.mesh, &mut arena)?;
    let lights = LightSampler::build(&scene, &mut arena)?;
    let mut state = RenderState::new(size, size, Shard::WHOLE, &mut arena)?;
    let settings = PathSettings { width: size, height: size, seed: 1, max_depth: UNLIMITED };
    let context = RenderContext {
        scene: &scene,
        bvh,
        lights,
        settings,
        level: Level::BASELINE,
        pilots: PilotSize::USUAL,
    };

    // Working memory of tasks, less than Method::scratch() where they take one sample after the other.
    let paths = if method == 4 { 8192 } else { 1024 };
    let photons = PhotonSettings { global: Some(paths), ..PhotonSettings::default() };
    let counts = BidirectionalSettings {
        light_paths: Some(1024),
        connections: Some(u32::from(method >= 3)),
        merging: Some(method == 5),
    };
    let scratch = (arena.available() * 5 / 8).min(SCRATCH) / 64 * 64;
    let mut executor = Loop::new(arena.slice(scratch)?);
    let mut buffer = Buffer::new(arena.slice(arena.available())?);
    let (memory, loops) = (&mut buffer, &mut executor);
    let cache = CacheSettings {
        metric: Metric::Halflight,
        error: 1e-3,
        strata: 8,
        fewest: 256,
        reserve: 0,
        widens: true,
        lobes,
        picture: None,
    };
    let lights = VirtualLightSettings { light_paths: Some(1024), connections: None };
    let chains = MetropolisSettings::default();
    match method {
        0 => run(PathTracing::<DiffuseOnly>::new(&context, Some(false), loops)?, &mut state, loops)?,
        2 => run(
            ProgressivePhotonMapping::<DiffuseOnly>::new(&context, photons, 0, memory, loops)?,
            &mut state,
            loops,
        )?,
        4 => run(PhotonMapping::<DiffuseOnly>::new(&context, photons, 0, memory, loops)?, &mut state, loops)?,
        6 => run(
            InstantRadiosity::<DiffuseOnly>::new(&context, &lights, (false, Some(false)), memory, loops, 0)?,
            &mut state,
            loops,
        )?,
        7 => run(Metropolis::<DiffuseOnly>::new(&context, &chains, memory, loops, 0)?, &mut state, loops)?,
        8 => run(IrradianceCaching::<DiffuseOnly>::new(&context, &cache, memory)?, &mut state, loops)?,
        9 => run(IrradianceCaching::<WithMetal>::new(&context, &cache, memory)?, &mut state, loops)?,
        _ => run(Bidirectional::<DiffuseOnly>::new(&context, &counts, memory, loops, 0)?, &mut state, loops)?,
    }
    for (i, pixel) in pixels.iter_mut().enumerate() {
        *pixel = state.film.mean((i % SIZE) as u32, (i / SIZE) as u32);
    }
    Ok(())
}

/// Eight samples of each pixel.
fn run(mut method: impl Method, state: &mut RenderState, executor: &mut Loop) -> Result<(), OutOfMemory> {
    method.round(&mut Round { executor, state, target: 8, step: 1 })
}

/// FNV-1a over the bits of the picture.
pub fn fingerprint(pixels: &[Rgb]) -> u64 {
    let bytes = pixels.iter().flat_map(|p| p.to_array()).flat_map(|v| v.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

fn main() {
    let (mut memory, mut pixels) = (vec![Line([0; 64]); LINES], [Rgb::ZERO; SIZE * SIZE]);
    for (method, name) in METHODS.iter().enumerate() {
        render(method, &mut memory, &mut pixels).expect("LINES is enough");
        for row in pixels.chunks(SIZE).step_by(2) {
            row.iter().for_each(|p| print!("{}", char::from(b" .:-=+*#%@"[(12.0 * p.y).min(9.0) as usize])));
            println!();
        }
        let least = (0..)
            .map(|i| LINES >> i)
            .take_while(|lines| render(method, &mut memory[..*lines], &mut pixels).is_ok());
        println!("{name} in {} KiB", least.last().map_or(0, |lines| lines / 16));
    }
    for method in 0..METHODS.len() {
        render(method, &mut memory, &mut pixels).expect("LINES is enough");
        println!("{:016x}", fingerprint(&pixels));
    }
}
