//! A picture by path tracing in rounds of the caller, which end at a relMSE of 1 %: rounds, estimate of the
//! error, and a picture in text. All structures are in one buffer.
#[path = "room/mod.rs"]
mod room;

use halflight_core::bsdf::DiffuseOnly;
use halflight_core::bvh::Bvh;
use halflight_core::estimate::{BrightnessClasses, ErrorEstimate, TileError, TileLight};
use halflight_core::film::{Film, PIXELS_PER_TILE, Tile};
use halflight_core::light::LightSampler;
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::method::path::PathTracing;
use halflight_core::method::{Loop, PilotSize, RenderContext, RenderMethod, RenderState, Round, Shard};
use halflight_core::transport::{PathSettings, UNLIMITED};

/// Pixels across and down.
const SIZE: u32 = 64;

fn main() -> Result<(), OutOfMemory> {
    let mut memory = vec![Line([0; 64]); 1 << 15];
    let mut arena = Arena::over(&mut memory);
    let (scene, level) = (room::scene(), halflight_core::Level::detect());
    let bvh = Bvh::build(&scene.mesh, &mut arena)?;
    let lights = LightSampler::build(&scene, &mut arena)?;
    let mut state = RenderState::new(SIZE, SIZE, Shard::WHOLE, &mut arena)?;
    let settings = PathSettings { width: SIZE, height: SIZE, seed: 1, max_depth: UNLIMITED };
    let pilots = PilotSize::USUAL;
    let context = RenderContext { scene: &scene, bvh, lights, settings, level, pilots };
    let scratch = arena.slice(PathTracing::<DiffuseOnly>::scratch().bytes())?;
    let mut executor = Loop::new(scratch);
    let mut method = PathTracing::<DiffuseOnly>::new(&context, None, &mut executor)?;
    for target in (1..10).map(|round| 4 << round) {
        let (executor, state) = (&mut executor, &mut state);
        method.round(&mut Round { executor, state, target, step: 8 })?;
        let Some(ErrorEstimate { relmse, lower, upper }) = error(&state.film) else { continue };
        println!("{target:4} samples: relMSE {relmse:.1e} (95 %: {lower:.1e} to {upper:.1e})");
        if upper < 0.01 {
            break;
        }
    }
    for y in (0..SIZE).step_by(2) {
        let shade = |x| char::from(b" .:-=+*#%@"[(12.0 * state.film.mean(x, y).y).min(9.0) as usize]);
        println!("{}", (0..SIZE).map(shade).collect::<String>());
    }
    Ok(())
}

/// Error by the halves of the film; `None` below four samples per pixel and for a black picture.
fn error(film: &Film) -> Option<ErrorEstimate> {
    let tiles = || (0..).map(|task| Tile::new(SIZE, SIZE, task)).zip(film.pixels().chunks(PIXELS_PER_TILE));
    let (mut light, mut classes) = (TileLight::default(), BrightnessClasses::default());
    tiles().for_each(|(_, pixels)| light += TileLight::of(pixels));
    tiles().for_each(|(tile, pixels)| classes.add(tile, pixels, light.mean()));
    let shrinkage = classes.shrinkage();
    let error = |(tile, pixels): (Tile, &_)| TileError::of(tile, pixels, light.mean(), &shrinkage);
    ErrorEstimate::of(tiles().map(error))
}
