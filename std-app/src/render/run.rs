//! A render from its settings to its result: checks, structures, method, and the rounds of the picture.

use super::audit::ThreadedAudit;
use super::built::{Built, BuiltMemory};
use super::deadline::Deadline;
use super::film_file::{Identity, Reader};
use super::hidden_light;
use super::history::Clock;
use super::memory::{Bank, Memory};
use super::method::{self, Attempt, Method, RenderSetup};
use super::picture::{self, Picture};
use super::threads::{Pool, Workers};
use super::{
    Ending, MOST_PIXELS, Progress, RenderError, RenderResult, Seconds, Settings, cache_file,
    environment_visibility, gaps, reconstruction,
};
use core::sync::atomic::AtomicBool;
use halflight_core::bsdf::Features;
use halflight_core::census::{Census, WithFeatures};
use halflight_core::film::Tile;
use halflight_core::findings::Decision::LeftOut;
use halflight_core::findings::{Finding, Findings};
use halflight_core::memory::{Arena, Footprint, MemorySource};
use halflight_core::method::{MethodPlan, RenderState, Shard};
use halflight_core::scene::Scene;
use halflight_core::transport::{PathSettings, UNLIMITED};

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
    resumed: Option<Reader>,
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
        let Shard { index, count } = settings.shard;
        let many = count as usize > Tile::count(settings.width, settings.height);
        if index >= count || many {
            return Err(RenderError::Shard);
        }
        let bank = Bank::new();
        let most = Memory::new(scene, settings, &bank).for_file();
        let cache = cache_file::open(scene, settings, most)?.map(|file| file.header.fingerprint());
        let resumed = settings.resume.as_deref().map(|file| Reader::open(file, most)).transpose()?;
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
        Identity::of(self.scene, method, &path_settings(self.settings), self.settings, self.cache.clone())
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
        let (width, height) = (settings.width, settings.height);
        let bank = Bank::new();
        let mut memory = Memory::new(scene, settings, &bank).beside(built)?;
        let mut film_lines = memory.take("film", RenderState::footprint(width, height))?;
        // Output images are counted now and allocated at the end.
        let pixels = width as usize * height as usize;
        let picture = Footprint::default().slice::<[f32; 3]>(pixels).slice::<[f32; 3]>(pixels);
        memory.set_aside("picture", picture.slice::<u32>(pixels))?;
        let Built { bvh, lights, seconds: build, .. } = *built;
        let lights = lights.with_level(settings.level);

        let mut clock = Clock::start(resumed.as_ref().map_or(0.0, |film| film.header.seconds));
        let left =
            settings.stop.seconds.map(|limit| limit - clock.seconds() - picture::ending_seconds(pixels));
        let workers = Workers::new(pool).ending_at(Deadline::until(interrupt).within(left));
        let plain = RenderSetup { scene, bvh, lights, settings, workers: &workers };
        let affords_pilots = method != Method::Path || plain.goal().affords_pilots(pixels);
        let hurried = (!affords_pilots).then(|| without_pilots(settings));
        let settings = hurried.as_ref().unwrap_or(settings);
        let plain = RenderSetup { settings, ..plain };
        let (lights, visibility) = environment_visibility::learn::<F>(&plain, &mut memory)?;
        let setup = RenderSetup { scene, bvh, lights, settings, workers: &workers };
        let plain = setup.paths::<F>(settings.seed);
        let sketch = |workers: &Workers| gaps::sketch(&plain, [width, height], workers);
        let is_open = settings.method.is_none() && resumed.is_none();
        let mut plan = if is_open { MethodPlan::open() } else { MethodPlan::from(method) };
        let mut may_fall_back = is_open;
        loop {
            let mut own = memory.within();
            let reconstruction = reconstruction::set_up::<F>(&setup, &mut own)?;
            let ready = match method::set_up::<F>(plan, &setup, &mut own) {
                Ok(Attempt::Instead(better)) => {
                    plan = *better;
                    continue;
                }
                Ok(Attempt::Ready(renderer)) => {
                    let (method, findings) = (renderer.chosen(), renderer.findings());
                    ThreadedAudit::<F>::new(&setup, &mut own, method).and_then(|audit| {
                        let hidden = hidden_light::measure::<F>(&setup, &mut own, method, &findings)?;
                        Ok((renderer, audit, hidden))
                    })
                }
                Err(error) => Err(error),
            };
            let (mut renderer, audit, hidden) = match ready {
                // A method that was chosen may need more memory than path tracing.
                Err(RenderError::Memory { .. }) if may_fall_back => {
                    may_fall_back = false;
                    plan = Method::Path.into();
                    continue;
                }
                ready => ready?,
            };
            let method = renderer.chosen();
            let picture = Picture {
                method,
                setup,
                state: RenderState::new(width, height, settings.shard, &mut Arena::over(&mut film_lines))?,
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
            let seconds = Seconds { build, ..done.seconds };
            let pilots =
                (!affords_pilots).then(|| Finding::new("pilots", LeftOut, "there is too little time"));
            let findings = Findings::default().and(pilots).and(visibility).and(done.findings);
            let (memory, memory_peak) = (own.uses(), own.peak());
            return Ok(RenderResult { memory, memory_peak, seconds, findings, ..done });
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
/// that a pilot chooses.
fn without_pilots(settings: &Settings) -> Settings {
    let reuse = settings.reuse.or(Some(false));
    let environment_visibility = settings.environment_visibility.or(Some(false));
    Settings { caustics: false, reuse, environment_visibility, ..settings.clone() }
}

/// Path settings common to all methods.
pub(super) fn path_settings(settings: &Settings) -> PathSettings {
    let Settings { width, height, seed, max_depth, .. } = *settings;
    PathSettings { width, height, seed, max_depth: max_depth.unwrap_or(UNLIMITED) }
}
