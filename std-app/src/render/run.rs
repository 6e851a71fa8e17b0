//! A render from its settings to its result: checks, structures, method, and the rounds of the picture.

use super::built::{Built, BuiltMemory};
use super::deadline::Deadline;
use super::files::{self, FilmHeader, FilmReader, Identity};
use super::history::Clock;
use super::memory::{Bank, Memory};
use super::method::{self, Attempt, Ready};
use super::picture::Picture;
use super::setup::RenderSetup;
use super::threads::{Pool, Workers};
use super::{
    Ending, Layers, MOST_PIXELS, Method, Progress, Reconstruct, RenderError, RenderResult, Seconds, Settings,
    environment_visibility, gaps, layers, reconstruction,
};
use core::sync::atomic::AtomicBool;
use halflight_core::bsdf::Features;
use halflight_core::census::{Census, WithFeatures};
use halflight_core::film::Tile;
use halflight_core::findings::Decision::LeftOut;
use halflight_core::findings::{Finding, Findings};
use halflight_core::memory::{Arena, Footprint, Line, MemorySource};
use halflight_core::method::{MethodPlan, RenderState, Shard};
use halflight_core::scene::Scene;

/// Renders `scene` until a rule of `settings.stop` holds or `interrupt` is raised. The calling thread calls
/// `progress` after each round, outside the measured time. [`crate::Renderer`] renders several views of a
/// scene with one build.
pub fn render(
    scene: &Scene,
    settings: &Settings,
    progress: &mut dyn FnMut(&Progress),
    interrupt: &AtomicBool,
) -> Result<RenderResult, RenderError> {
    let request = Request::open(scene, settings)?;
    let (pool, owner) = (Pool::new(settings.threads)?, BuiltMemory::default());
    let built = Built::new(scene, (settings.level, settings.memory), &pool, &owner)?;
    request.render(&built, &pool, progress, interrupt)
}

/// A picture that is asked for, after its settings and files were checked.
pub(crate) struct Request<'a> {
    scene: &'a Scene<'a>,
    settings: &'a Settings,
    method: Method,
    /// Fingerprint of the cache file.
    cache: Option<String>,
    resumed: Option<FilmReader>,
}

impl<'a> Request<'a> {
    /// Checks `settings` and the files that they name: those of another scene are refused before any
    /// structure is built.
    pub(crate) fn open(scene: &'a Scene<'a>, settings: &'a Settings) -> Result<Self, RenderError> {
        let pixels = u64::from(settings.width) * u64::from(settings.height);
        if !(1..=MOST_PIXELS).contains(&pixels) {
            return Err(RenderError::Size);
        }
        let size = [settings.width, settings.height];
        if settings.reference.as_ref().is_some_and(|reference| [reference.width, reference.height] != size) {
            return Err(RenderError::Reference);
        }
        let Shard { index, count, window } = settings.shard;
        let many = count as usize > Tile::count(settings.width, settings.height);
        // Film files have no windows.
        let keeps = settings.checkpoint.is_some() || settings.resume.is_some();
        let is_impossible = window.is_some_and(|window| keeps || window.frame() != size);
        if index >= count || many || is_impossible {
            return Err(RenderError::Shard);
        }
        let bank = Bank::new();
        let most = Memory::new(scene, settings, &bank).for_file();
        let cache = files::open_cache(scene, settings, most)?.map(|file| file.header.fingerprint());
        let resumed = settings.resume.as_deref().map(|file| FilmReader::open(file, most)).transpose()?;
        // A film file holds the method that prepasses chose.
        let of_film = resumed.as_ref().and_then(|film| film.header.method());
        let usual = Method::named(Census::of(scene).plan().method).unwrap_or(Method::Path);
        let method = settings.method.or(of_film).unwrap_or(usual);
        let keeps_cache = settings.load_cache.is_some() || settings.save_cache.is_some();
        if keeps_cache && !method.has_records() {
            return Err(RenderError::NoCache);
        }
        let request = Self { scene, settings, method, cache, resumed };
        if let Some(film) = &request.resumed {
            film.check(&request.identity(method), settings.shard)?;
        }
        Ok(request)
    }

    fn identity(&self, method: Method) -> Identity {
        FilmHeader::identity(self.scene, method, self.settings, self.cache.as_deref())
    }

    /// Memory with the structures `built`, the film, whose bytes come second, and the pictures of the result,
    /// which are counted now and allocated at the end.
    fn memory<'m>(&self, built: &Built, bank: &'m Bank) -> Result<(Memory<'m>, Vec<Line>), RenderError> {
        let Settings { width, height, .. } = *self.settings;
        let mut memory = Memory::new(self.scene, self.settings, bank);
        built.count_in(&mut memory)?;
        let film = memory.take("film", RenderState::footprint(width, height))?;
        let pixels = width as usize * height as usize;
        let pictures = Footprint::default().slice::<[f32; 3]>(pixels).slice::<[f32; 3]>(pixels);
        memory.set_aside("picture", pictures.slice::<u32>(pixels))?;
        if self.settings.shown_bytes > 0 {
            memory.set_aside("preview", Footprint::default().slice::<u8>(self.settings.shown_bytes))?;
        }
        Ok((memory, film))
    }

    /// An empty film in the bytes of `lines`.
    fn state<'m>(&self, lines: &'m mut [Line]) -> Result<RenderState<'m>, RenderError> {
        let Settings { width, height, shard, .. } = *self.settings;
        Ok(RenderState::new(width, height, shard, &mut Arena::over(lines))?)
    }

    /// Renders with the structures of the scene in code for its features.
    pub(crate) fn render(
        self,
        built: &Built,
        pool: &Pool,
        progress: &mut dyn FnMut(&Progress),
        interrupt: &AtomicBool,
    ) -> Result<RenderResult, RenderError> {
        let features = Census::of(self.scene).plan().features;
        features.dispatch(Render { request: self, built, pool, progress, interrupt })
    }
}

/// A render, to be compiled for the features of its scene.
struct Render<'a> {
    request: Request<'a>,
    built: &'a Built<'a>,
    pool: &'a Pool,
    progress: &'a mut dyn FnMut(&Progress),
    interrupt: &'a AtomicBool,
}

impl WithFeatures for Render<'_> {
    type Out = Result<RenderResult, RenderError>;

    fn run<F: Features>(self) -> Self::Out {
        let Render { mut request, built, pool, progress, interrupt } = self;
        let mut resumed = request.resumed.take();
        let Request { scene, settings, method, .. } = request;
        let bank = Bank::new();
        let (mut memory, mut film) = request.memory(built, &bank)?;
        let pixels = settings.width as usize * settings.height as usize;
        let mut clock = Clock::start(resumed.as_ref().map_or(0.0, |film| film.header.seconds));
        let left = settings.stop.seconds.map(|limit| limit - clock.seconds() - settings.ending_seconds());
        let workers = Workers::new(pool).ending_at(Deadline::until(interrupt).within(left));
        let lights = built.lights.with_level(settings.level);
        let plain = RenderSetup { scene, bvh: built.bvh, lights, settings, workers: &workers };
        let affords_pilots = method != Method::Path || plain.goal().affords_pilots(pixels);
        let hurried = (!affords_pilots).then(|| without_pilots(settings));
        let settings = hurried.as_ref().unwrap_or(settings);
        let (lights, visibility) =
            environment_visibility::learn::<F>(&RenderSetup { settings, ..plain }, &mut memory)?;
        let pilots = (!affords_pilots).then(|| Finding::new("pilots", LeftOut, "there is too little time"));
        let setup = RenderSetup { lights, settings, ..plain };
        let tracer = setup.paths::<F>(settings.seed);
        let surfaces = layers::surfaces::<F>(&setup, &mut memory)?;
        let sketch = |workers: &Workers| gaps::sketch(&tracer, [settings.width, settings.height], workers);
        let is_open = settings.method.is_none() && resumed.is_none();
        let mut plan = if is_open { MethodPlan::open() } else { MethodPlan::from(method) };
        let mut may_fall_back = is_open;
        loop {
            let mut own = memory.within();
            let Ready { mut renderer, audit, hidden } = match method::set_up::<F>(plan, &setup, &mut own) {
                Ok(Attempt::Ready(ready)) => *ready,
                Ok(Attempt::Instead(better)) => {
                    plan = *better;
                    continue;
                }
                // A method that was chosen may need more memory than path tracing.
                Err(RenderError::Memory { .. }) if may_fall_back => {
                    may_fall_back = false;
                    plan = Method::Path.into();
                    continue;
                }
                Err(error) => return Err(error),
            };
            let method = renderer.chosen();
            let (reconstruction, raw) = reconstruction::set_up::<F>(&setup, method, &mut own)?;
            let picture = Picture {
                method,
                setup,
                state: request.state(&mut film)?,
                audit,
                reconstruction,
                hidden,
                memory: &mut own,
                identity: request.identity(method),
                resumed: resumed.take(),
                clock: &mut clock,
                sketch: &sketch,
                progress: &mut *progress,
                interrupt,
            };
            let done = picture.render(&mut *renderer)?;
            if may_fall_back && falls_back(&done, settings, clock.seconds()) {
                may_fall_back = false;
                plan = MethodPlan::instead_of(done.method, &done.findings);
                continue;
            }
            let seconds = Seconds { build: built.seconds(), ..done.seconds };
            let findings = Findings::default().and(pilots).and(visibility).and(done.findings).and(raw);
            let (memory, memory_peak) = (own.uses(), own.peak());
            let layers = Layers { surfaces, ..done.layers };
            return Ok(RenderResult { layers, memory, memory_peak, seconds, findings, ..done });
        }
    }
}

/// True if path tracing is to replace the method that prepasses chose for the picture `done`: the requested
/// error is out of the method's reach, and at least half of the time is left.
fn falls_back(done: &RenderResult, settings: &Settings, seconds: f64) -> bool {
    let is_lost = matches!(done.ending, Ending::Biased | Ending::NoiseFloor);
    let has_time = settings.stop.seconds.is_none_or(|limit| seconds <= 0.5 * limit);
    is_lost && has_time && settings.shard == Shard::WHOLE
}

/// Settings of a picture whose time suffices for a few samples of each pixel: paths without the structures
/// that a pilot chooses, and without a reconstruction.
fn without_pilots(settings: &Settings) -> Settings {
    let reuse = settings.reuse.or(Some(false));
    let environment_visibility = settings.environment_visibility.or(Some(false));
    let reconstruct = Reconstruct::Off;
    Settings { caustics: false, reuse, environment_visibility, reconstruct, ..settings.clone() }
}
