//! Irradiance caching for the program: caustics by photons where a first look says that they pay, files of caches, surveys.

use super::cache_memory;
use super::cache_settings::CacheUse;
use super::caster::{Cast, Caster};
use super::caustics::{self, CausticUse};
use super::path::Paths;
use super::photon_view::PhotonView;
use super::{Borrower, Renderer, Stage};
use crate::drive::RenderError;
use crate::drive::cache_file::{self, Half, Header, Reader, View};
use crate::drive::crew::Crew;
use crate::drive::held_out::EXACT;
use crate::drive::kept::Kept;
use crate::drive::memory::Memory;
use crate::drive::survey::{self, Survey};
use crate::drive::threads::{End, Threads};
use crate::drive::workers::Workers;
use crate::save::Patience;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{IrradianceCache, Record};
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::method::irradiance_cache::{CacheSettings, IrradianceCaching};
use halflight_core::method::{Method as _, PhotonUse};
use halflight_core::transport::PathIntegrator;

/// Looks for caustics, takes the memory, sets the method up, and hands it to `then`.
pub(super) fn with<'m, F: Features, T>(
    stage: &Stage<'m>,
    memory: &mut Memory<'m>,
    then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let Stage { scene, settings, .. } = *stage;
    let file = cache_file::open(scene, settings, memory.for_file())?;
    let header = file.as_ref().map_or_else(|| Header::new(scene, settings), |file| file.header.clone());
    let bytes = Footprint::default().slice::<Record>(header.records());
    memory.set_aside(LOADED, bytes)?;
    let loaded = Loaded { header, records: file.map(Reader::records).transpose()?.unwrap_or_default() };
    let cache = cache_memory::settings::<F>(stage, loaded.fewest());
    let mut lines = Vec::new();
    let (cast, caustics) = find_caustics::<F>(stage, memory, &cache, &mut lines)?;
    if cast.is_some() {
        return set_up::<F, T>(stage, memory, (loaded, &cache), (cast, caustics), then);
    }
    // As if nobody had looked.
    drop(lines);
    memory.give_back("emission");
    set_up::<F, T>(stage, memory, (loaded, &cache), (None, caustics), then)
}

/// How photons of caustics are to be shot, by what is kept in `lines`, if they are worth it and there is memory for them
/// beside what `cache` needs.
fn find_caustics<'l, F: Features>(
    stage: &Stage,
    memory: &mut Memory,
    cache: &CacheSettings,
    lines: &'l mut Vec<Line>,
) -> Result<(Option<Cast<'l>>, CausticUse), RenderError> {
    let Stage { lights, workers, .. } = *stage;
    if !caustics::are_possible(stage) {
        return Ok((None, CausticUse::default()));
    }
    let scratch = cache_memory::scratch::<F>(cache, true).bytes().saturating_mul(workers.count());
    // As much for records as for photons.
    let others = scratch.saturating_add(cache_memory::later(cache)).saturating_add(caustics::least_photons());
    if !caustics::has_memory(memory, lights, others) {
        return Ok((None, CausticUse { lacks_memory: true, ..CausticUse::default() }));
    }
    let scratch = memory.take_each("paths", caustics::scratch::<F>(), workers.count())?;
    let mut paths = Paths::<F>::alone(stage, scratch);
    *lines = memory.take("emission", caustics::footprint(lights))?;
    let mut arena = Arena::new(bytemuck::cast_slice_mut(lines));
    let (cast, _) = caustics::look_first::<F>(stage, &mut paths, true, &mut arena)?;
    let caustics = paths.caustics;
    drop(paths);
    memory.give_back("paths");
    Ok((cast, caustics))
}

/// What the memory of records of a file is counted as, until caches have them.
const LOADED: &str = "loaded records";

/// What a file has of caches.
struct Loaded {
    header: Header,
    records: [Vec<Record>; 2],
}

impl Loaded {
    /// Records that there must be room for in each half.
    fn fewest(&self) -> usize {
        self.records.iter().map(Vec::len).max().unwrap_or(0)
    }
}

/// Takes the memory, sets the method up, and hands it to `then`; with photons, if there is a cast of them.
fn set_up<'m, F: Features, T>(
    stage: &Stage<'m>,
    memory: &mut Memory<'m>,
    (loaded, cache): (Loaded, &CacheSettings),
    (cast, caustics): (Option<Cast>, CausticUse),
    then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let Stage { scene, settings, workers, .. } = *stage;
    let scratch = cache_memory::scratch::<F>(cache, cast.is_some());
    let scratch = memory.take_each("paths", scratch, workers.count())?;
    let caster = match cast {
        Some(cast) => Some(Caster::new(stage, memory, cast, true, cache_memory::later(cache))?),
        None => None,
    };
    let mut method = IrradianceCaching::<F>::new(&stage.context(), cache, memory)?;
    let exact = PathIntegrator::<F>::gather_scratch(EXACT);
    let needed = (exact.bytes() * workers.count()).saturating_add(cache.reserve);
    let survey = match settings.survey.filter(|_| memory.has(needed)) {
        Some(points) => Some((points, memory.take_each("survey", exact, workers.count())?)),
        None => None,
    };
    let Loaded { header, records } = loaded;
    let view = View::of(scene, settings);
    method.restore(records.each_ref().map(|records| &records[..]), header.halves.map(|half| half.gathered));
    if header.serves(&view) {
        method.finish();
    }
    drop(records);
    memory.give_back(LOADED);
    let mut cached = Cached {
        method,
        stage: *stage,
        caster,
        caustics,
        scratch,
        survey,
        view,
        loaded: header.halves,
        header,
        kept: Kept::in_file(settings.save_cache.as_deref()),
        rays: cache.strata.pow(2) as u32,
    };
    then(&mut cached, memory)
}

/// See the file.
struct Cached<'c, 'm, F> {
    method: IrradianceCaching<'m, F>,
    stage: Stage<'c>,
    /// Of photons of caustics, where they are worth it.
    caster: Option<Caster<'c>>,
    caustics: CausticUse,
    scratch: Vec<Vec<Line>>,
    /// Points, and memory for gathering there.
    survey: Option<(u32, Vec<Vec<Line>>)>,
    /// What a file of both halves says of them.
    header: Header,
    view: View,
    /// What came from a file.
    loaded: [Half; 2],
    /// Where they are kept.
    kept: Kept<'c>,
    /// Gather rays of a record.
    rays: u32,
}

impl<F: Features> Cached<'_, '_, F> {
    /// Fills both caches, or goes on with them, and keeps them in their file.
    fn fill(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        let Self { method, caster, scratch, .. } = self;
        let mut all = true;
        for number in 0..2 {
            // With a limit of depth gather rays ask for no photons.
            let asks = !method.is_filled(number) && !method.paths().is_limited();
            let photons = match caster.as_mut().filter(|_| asks) {
                Some(caster) => match caster.for_records::<F>(number as u32, scratch, crew)? {
                    Some(photons) => Some(photons),
                    None => {
                        all = false;
                        break;
                    }
                },
                None => None,
            };
            let merging = photons.as_ref().map(|photons| photons.merging());
            all = crew.round(scratch, |round| method.fill(number, merging, round))?;
            if !all {
                break;
            }
        }
        if all {
            method.freeze();
            if !method.is_cut() {
                self.header.is_filled_for(self.view.clone());
            }
        }
        self.keep(None);
        Ok(())
    }

    /// Writes the file on the way, or what is owed for the last time.
    fn keep(&mut self, last: Option<Patience>) {
        let caches = self.method.caches();
        for ((half, cache), gathered) in self.header.halves.iter_mut().zip(caches).zip(self.method.gathered())
        {
            *half = Half { records: cache.records().len() as u32, gathered };
        }
        let header = &self.header;
        self.kept.keep(last, |path, patience| cache_file::write(path, header, caches, patience));
    }
}

impl<F: Features> Renderer for Cached<'_, '_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        if !self.method.is_frozen() {
            // A film that goes on has the rays of all this already.
            let is_resumed = crew.canvas.spp() > 0;
            let counted = crew.canvas.counters;
            self.fill(crew)?;
            if !self.method.is_frozen() {
                return Ok(());
            }
            if is_resumed {
                crew.canvas.counters = counted;
            }
        }
        match &mut self.caster {
            Some(caster) => caster.round(&self.method.cached_paths(), &mut self.scratch, crew),
            None => Ok(crew.round(&mut self.scratch, |round| self.method.round(round))?),
        }
    }

    fn lend_photons(&mut self, then: &mut Borrower) -> Result<(), RenderError> {
        match &mut self.caster {
            Some(caster) => caster.lend(then),
            None => then(None),
        }
    }

    fn risks(&mut self, workers: &Workers) -> Result<Vec<f32>, RenderError> {
        let settings = self.stage.settings;
        let size = [settings.width, settings.height];
        let mut executor = Threads::new(workers, &mut self.scratch).until(End::Round(None));
        survey::risks(self.method.paths(), self.method.caches(), size, &mut executor)
    }

    fn survey(&mut self, workers: &Workers) -> Result<Option<Survey>, RenderError> {
        let Some((points, scratch)) = &mut self.survey else { return Ok(None) };
        let caches = self.method.caches();
        if caches.iter().all(|cache| cache.records().is_empty()) {
            return Ok(None);
        }
        let settings = self.stage.settings;
        let size = [settings.width, settings.height];
        let executor = Threads::new(workers, scratch);
        survey::survey(self.method.paths(), caches, size, (*points, settings.stop.seconds), executor)
    }

    fn cache(&self) -> Option<CacheUse> {
        let caches = self.method.caches();
        let sum = |of: fn(&IrradianceCache) -> u64| caches.iter().map(|cache| of(cache)).sum();
        let both = |halves: [u32; 2]| halves.into_iter().map(u64::from).sum::<u64>();
        Some(CacheUse {
            records: sum(|cache| cache.records().len() as u64),
            capacity: sum(|cache| cache.capacity() as u64),
            refused: sum(|cache| cache.refused()),
            loaded: both(self.loaded.map(|half| half.records)),
            gathered: both(self.method.gathered()) - both(self.loaded.map(|half| half.gathered)),
            rays: self.rays,
            is_cut: self.method.is_cut(),
            seconds: self.stage.workers.seconds_of("cache"),
        })
    }

    fn finish(&mut self, patience: Patience) {
        self.keep(Some(patience));
    }

    fn kept(&self) -> Option<&Kept<'_>> {
        Some(&self.kept)
    }

    fn caustics(&self) -> CausticUse {
        self.caustics
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        self.caster.as_mut().map_or(Ok(None), |caster| caster.view::<F>())
    }

    fn photons(&self) -> Option<PhotonUse> {
        self.caster.as_ref().map(|caster| caster.used)
    }
}
