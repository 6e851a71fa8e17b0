//! A small picture by every method in one buffer: no heap, no threads, an operating system only to print.
//! `cargo verify targets` runs this very file without libc, as WebAssembly and for Cortex-M: same bits.
#[path = "room/mod.rs"]
pub mod room;

use halflight_core::{
    Arena, BidirectionalSettings, CacheOptions, Level, Line, LobeSettings, Loop, Method, MetropolisSettings,
    PathOptions, PhotonSettings, RenderError, Renderer, Rgb, Settings, Until, VirtualLightSettings,
};

/// Pixels across and down.
pub const SIZE: usize = 32;
/// Cache lines that the structures of each method take together.
pub const LINES: usize = 1 << 16;
/// Small photon maps, caches and sets of light paths.
const PHOTONS: PhotonSettings = PhotonSettings { global: Some(8192), ..PhotonSettings::DEFAULT };
const COUNTS: BidirectionalSettings =
    BidirectionalSettings { light_paths: Some(1024), connections: Some(1), merging: Some(false) };
const CACHE: CacheOptions = CacheOptions { strata: Some(8), records: Some(512), ..CacheOptions::DEFAULT };
const LOBES: LobeSettings = LobeSettings { tolerance: 0.05, degree: 2, ..LobeSettings::DEFAULT };
/// All methods but the clamped form of instant radiosity.
pub const METHODS: [Method; 10] = [
    Method::Path(PathOptions::PLAIN),
    Method::LightTracing(COUNTS),
    Method::ProgressivePhotons(PHOTONS),
    Method::Bidirectional(COUNTS),
    Method::PhotonMap(PHOTONS),
    Method::VertexMerging(BidirectionalSettings { merging: Some(true), ..COUNTS }),
    Method::InstantRadiosity(VirtualLightSettings { light_paths: Some(1024), connections: None }),
    Method::Metropolis(MetropolisSettings::DEFAULT),
    Method::IrradianceCache(CACHE),
    Method::RadianceCache(CACHE, LOBES),
];

/// Renders eight samples of each pixel of the room by `method`, row by row from the top, all in `memory`.
pub fn render(method: Method, memory: &mut [Line], pixels: &mut [Rgb]) -> Result<(), RenderError> {
    let scene = room::with_metal_wall();
    let usual = Settings::new([SIZE as u32; 2]).with_method(method);
    let settings = Settings { level: Level::BASELINE, audit: Some(0.0), ..usual };
    let mut arena = Arena::over(memory);
    let scratch = Renderer::required_memory(&scene, &settings).scratch.min(arena.available() / 2);
    let mut executor = Loop::new(arena.slice(scratch)?);
    let mut renderer = Renderer::new(&scene, &settings, &mut arena, &mut executor)?;
    renderer.step(&mut executor, Until::Samples(8))?;
    pixels.iter_mut().zip(renderer.picture()).for_each(|(pixel, radiance)| *pixel = radiance);
    Ok(())
}

fn main() {
    let (mut memory, mut pixels) = (vec![Line([0; 64]); LINES], [Rgb::ZERO; SIZE * SIZE]);
    for method in METHODS {
        render(method, &mut memory, &mut pixels).expect("LINES is enough");
        for row in pixels.chunks(SIZE).step_by(2) {
            let shade = |pixel: &Rgb| char::from(b" .:-=+*#%@"[(12.0 * pixel.y).min(9.0) as usize]);
            println!("{}", row.iter().map(shade).collect::<String>());
        }
        println!("{}\n{:016x}", method.name(), room::fingerprint(&pixels));
    }
}
