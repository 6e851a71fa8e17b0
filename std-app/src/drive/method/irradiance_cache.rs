//! Irradiance caching: the indirect light of diffuse surfaces is gathered at few points and interpolated between them,
//! all other light is path traced, or, where a first look says that it pays, caustics come from photons (`caster.rs`).
//! Two caches that know nothing of each other serve the even and the odd samples, so that the halves of the film tell the
//! errors of records too.
//!
//! The first round begins with the overture of both, for which it has half of the time if that is limited (`haste.rs`).
//! Then caches are frozen; a point that no record reaches is path traced, as is every surface that is not diffuse. Caches
//! can be kept in a file, and be the first records of another picture of the same scene.

use super::cache_memory::{Needs, has_indirect_light};
use super::cache_settings::CacheUse;
use super::caster::{Cast, Caster};
use super::caustics::{self, CausticUse};
use super::haste::Haste;
use super::overture::{Growing, Overture};
use super::path::Paths;
use super::photon_view::PhotonView;
use super::{Borrower, Method, Renderer, Stage};
use crate::drive::audit::Audit;
use crate::drive::cache_file::{self, Half, Header, Reader, View};
use crate::drive::crew::Crew;
use crate::drive::held_out::EXACT;
use crate::drive::kept::Kept;
use crate::drive::memory::Memory;
use crate::drive::survey::{self, Survey};
use crate::drive::workers::Workers;
use crate::drive::{RenderError, Stop};
use crate::save::Patience;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{CellFlux, IrradianceCache, Record, metric};
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::method::PhotonUse;
use halflight_core::transport::PathIntegrator;
use halflight_core::transport::cached::gather::{GatherPoint, Gathering};
use halflight_core::transport::path::WAVE;
use std::time::Instant;

/// Pixels for each record that a cache has memory for, where that is not limited.
const PIXELS_PER_RECORD: usize = 8;

/// The fewest, for small pictures.
const FEWEST_RECORDS: usize = 4096;

/// Least radius of a record in pixels: neighbouring pixels of the overture reach each other.
pub(in crate::drive) const LEAST_PIXELS: f32 = 2.0;

/// Looks for caustics, takes the memory, sets the method up, and hands it to `then`.
pub(super) fn with<F: Features, T>(
    stage: &Stage,
    memory: &mut Memory,
    then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let Stage { scene, settings, .. } = *stage;
    let file = cache_file::open(scene, settings, memory.for_file())?;
    let header = file.as_ref().map_or_else(|| Header::new(scene, settings), |file| file.header.clone());
    let bytes = Footprint::default().slice::<Record>(header.records());
    memory.set_aside(LOADED, bytes)?;
    let loaded = Loaded { header, records: file.map(Reader::records).transpose()?.unwrap_or_default() };
    let mut lines = Vec::new();
    let (cast, caustics) = find_caustics::<F>(stage, memory, loaded.fewest(), &mut lines)?;
    if cast.is_some() {
        return set_up::<F, T>(stage, memory, loaded, (cast, caustics), then);
    }
    // As if nobody had looked.
    drop(lines);
    memory.give_back("emission");
    set_up::<F, T>(stage, memory, loaded, (None, caustics), then)
}

/// How photons of caustics are to be shot, by what is kept in `lines`, if they are worth it and there is memory beside records,
/// of which each half has room for `fewest` at least.
fn find_caustics<'l, F: Features>(
    stage: &Stage,
    memory: &mut Memory,
    fewest: usize,
    lines: &'l mut Vec<Line>,
) -> Result<(Option<Cast<'l>>, CausticUse), RenderError> {
    let Stage { lights, workers, .. } = *stage;
    if !caustics::are_possible(stage) {
        return Ok((None, CausticUse::default()));
    }
    let needs = Needs::of::<F>(stage, true);
    // As much for records as for photons.
    let others = needs.bytes(stage).saturating_add(Needs::later::<F>(stage, fewest));
    let others = others.saturating_add(caustics::least_photons());
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
fn set_up<F: Features, T>(
    stage: &Stage,
    memory: &mut Memory,
    loaded: Loaded,
    (cast, caustics): (Option<Cast>, CausticUse),
    then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let Stage { scene, bvh, settings, workers, .. } = *stage;
    let needs = Needs::of::<F>(stage, cast.is_some());
    let scratch = memory.take_each("paths", needs.scratch, workers.count())?;
    let [coarse, strata] = needs.strata;
    let mut tables = [
        memory.take("gathering", CellFlux::footprint(coarse))?,
        memory.take("gathering", CellFlux::footprint(strata))?,
    ];
    let [a, b] = &mut tables;
    let coarse = CellFlux::build(coarse, &mut Arena::new(bytemuck::cast_slice_mut(a)))?;
    let flux = CellFlux::build(strata, &mut Arena::new(bytemuck::cast_slice_mut(b)))?;
    let fewest = loaded.fewest();
    let caster = match cast {
        Some(cast) => {
            let later = Needs::later::<F>(stage, fewest);
            Some(Caster::new(stage, memory, cast, true, later)?)
        }
        None => None,
    };
    let others = Audit::bytes::<F>(stage, Method::IrradianceCache.is_biased());
    let pixels = settings.width as usize * settings.height as usize;
    let wanted = (pixels / PIXELS_PER_RECORD).max(FEWEST_RECORDS).saturating_add(fewest);
    let available = memory.available().saturating_sub(others);
    let capacity = wanted.min(capacity_of(available / 2)).max(fewest);
    memory.set_aside("cache", Footprint::default().slice::<GatherPoint>(2 * capacity))?;
    let footprint = IrradianceCache::footprint(capacity);
    let mut lines = [memory.take("cache", footprint)?, memory.take("cache", footprint)?];
    let [even, odd] = &mut lines;
    let cache = |lines| {
        IrradianceCache::new(&bvh.bounds(), capacity, &mut Arena::new(bytemuck::cast_slice_mut(lines)))
    };
    let (even, odd) = (cache(even)?, cache(odd)?);

    let exact = PathIntegrator::<F>::gather_scratch(EXACT);
    let surveying = settings.survey.filter(|_| memory.has(exact.bytes() * workers.count() + others));
    let survey = match surveying {
        Some(points) => Some((points, memory.take_each("survey", exact, workers.count())?)),
        None => None,
    };
    let usual = metric::Settings::new(settings.cache.metric, 0.5 * bvh.bounds().diagonal());
    let metric = metric::Settings { error: settings.cache.allowed(), ..usual };
    let mut method = Cached {
        tracer: stage.paths::<F>(settings.seed),
        gathering: Gathering { flux: &flux, metric, least_pixels: LEAST_PIXELS },
        coarse: &coarse,
        size: [settings.width, settings.height],
        halves: [Growing::new(even, 0), Growing::new(odd, 1)],
        caster,
        caustics,
        scratch,
        survey,
        view: View::of(scene, settings),
        loaded: loaded.header.halves,
        header: loaded.header,
        kept: Kept::in_file(settings.save_cache.as_deref()),
        is_filled: false,
        stop: settings.stop,
        haste: None,
        is_cut: false,
        seconds: 0.0,
    };
    let is_served = !has_indirect_light(settings) || method.header.serves(&method.view);
    for ((growing, records), half) in method.halves.iter_mut().zip(&loaded.records).zip(method.loaded) {
        growing.restore(records, half.gathered);
        if is_served {
            growing.finish();
        }
    }
    drop(loaded.records);
    memory.give_back(LOADED);
    then(&mut method, memory)
}

/// How many records fit into `bytes`, with the place of each.
fn capacity_of(bytes: usize) -> usize {
    let places = IrradianceCache::capacity_of(bytes).saturating_mul(size_of::<GatherPoint>());
    IrradianceCache::capacity_of(bytes.saturating_sub(places))
}

/// See the file.
struct Cached<'a, F> {
    tracer: PathIntegrator<'a, F>,
    gathering: Gathering<'a>,
    size: [u32; 2],
    halves: [Growing<'a>; 2],
    /// Of photons of caustics, where they are worth it.
    caster: Option<Caster<'a>>,
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
    kept: Kept<'a>,
    is_filled: bool,
    /// Tables of fewer strata, for what rough surfaces see.
    coarse: &'a CellFlux<'a>,
    stop: Stop,
    /// When caches must be filled, where there is a limit of time, from the first time on that they are.
    haste: Option<Haste>,
    is_cut: bool,
    seconds: f64,
}

impl<F: Features> Cached<'_, F> {
    /// Fills both halves, or goes on with it, and keeps them; whether that is done: not where the round is over.
    fn fill(&mut self, crew: &mut Crew) -> Result<bool, RenderError> {
        let start = Instant::now();
        if self.haste.is_none() {
            // A film that goes on has the time that is left.
            let left = crew.round.deadline.map(|end| end.saturating_duration_since(start).as_secs_f64());
            self.haste = self.stop.seconds.map(|seconds| Haste::new(left.unwrap_or(seconds)));
        }
        let Self { tracer, gathering, coarse, haste, size, halves, caster, scratch, .. } = self;
        let mut all = true;
        for (i, half) in halves.iter_mut().enumerate() {
            let mut photons = None;
            // Where depth is limited, rays that gather ask for none.
            if let Some(caster) = caster.as_mut().filter(|_| !half.is_finished() && !tracer.is_limited()) {
                let Some(found) = caster.for_records::<F>(i as u32, scratch, crew)? else {
                    all = false;
                    break;
                };
                photons = Some(found);
            }
            let until = haste.and_then(|haste| haste.end(i));
            let photons = photons.as_ref().map(|photons| photons.merging());
            let overture = Overture { tracer, photons, gathering: *gathering, coarse, size: *size };
            if !crew.hurry(until, |crew| overture.fill(half, crew, scratch))? {
                if crew.is_over() {
                    all = false;
                    break;
                }
                // What goes into a file is good where it is.
                if !self.kept.is_some() {
                    overture.widen(half, crew, scratch)?;
                }
                half.finish();
                self.is_cut = true;
            }
        }
        if all {
            halves.iter_mut().for_each(|half| half.cache.rebuild());
            if !self.is_cut {
                self.header.is_filled_for(self.view.clone());
            }
        }
        self.keep(None);
        self.seconds += start.elapsed().as_secs_f64();
        Ok(all)
    }

    /// Brings the tiles to their targets.
    fn take_samples(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        let Self { tracer, halves: [even, odd], scratch, caster, .. } = self;
        let tracer = tracer.with_caches([&even.cache, &odd.cache]);
        if let Some(caster) = caster {
            return caster.round(&tracer, scratch, crew);
        }
        crew.tiles(u32::MAX, scratch, &|task, samples, arena, pixels| {
            tracer.run(task, samples, WAVE, arena, pixels)
        })?;
        Ok(())
    }

    /// Writes the file on the way, or what is owed for the last time.
    fn keep(&mut self, last: Option<Patience>) {
        for (half, growing) in self.header.halves.iter_mut().zip(&self.halves) {
            *half = Half { records: growing.cache.records().len() as u32, gathered: growing.gathered() };
        }
        let (header, [even, odd]) = (&self.header, &self.halves);
        self.kept.keep(last, |path, patience| {
            cache_file::write(path, header, [&even.cache, &odd.cache], patience)
        });
    }
}

impl<F: Features> Renderer for Cached<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        // A film that goes on has the rays of all this already.
        let is_resumed = !self.is_filled && crew.canvas.spp() > 0;
        let counted = crew.canvas.counters;
        self.is_filled = self.is_filled || self.fill(crew)?;
        if !self.is_filled {
            return Ok(());
        }
        if is_resumed {
            crew.canvas.counters = counted;
        }
        self.take_samples(crew)
    }

    fn lend_photons(&mut self, then: &mut Borrower) -> Result<(), RenderError> {
        match &mut self.caster {
            Some(caster) => caster.lend(then),
            None => then(None),
        }
    }

    fn risks(&mut self, workers: &Workers) -> Result<Vec<f32>, RenderError> {
        let Self { tracer, size, halves: [even, odd], scratch, .. } = self;
        survey::risks(tracer, [&even.cache, &odd.cache], *size, workers, scratch)
    }

    fn survey(&mut self, workers: &Workers) -> Result<Option<Survey>, RenderError> {
        let Self { tracer, size, halves: [even, odd], survey, stop, .. } = self;
        let Some((points, scratch)) = survey else { return Ok(None) };
        let caches = [&even.cache, &odd.cache];
        if caches.iter().all(|cache| cache.records().is_empty()) {
            return Ok(None);
        }
        survey::survey(tracer, caches, *size, *points, (workers, stop.seconds), scratch)
    }

    fn cache(&self) -> Option<CacheUse> {
        let sum = |of: fn(&IrradianceCache) -> u64| self.halves.iter().map(|half| of(&half.cache)).sum();
        let gathered = |halves: [u32; 2]| halves.into_iter().map(u64::from).sum::<u64>();
        Some(CacheUse {
            records: sum(|cache| cache.records().len() as u64),
            capacity: sum(|cache| cache.capacity() as u64),
            refused: sum(|cache| cache.refused()),
            loaded: gathered(self.loaded.map(|half| half.records)),
            gathered: gathered([0, 1].map(|i| self.halves[i].gathered() - self.loaded[i].gathered)),
            rays: self.gathering.flux.n().pow(2) as u32,
            is_cut: self.is_cut,
            seconds: self.seconds,
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
