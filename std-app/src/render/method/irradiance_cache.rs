//! Irradiance and radiance caching in the program: caustic photons if a prepass finds that they pay, cache
//! files, and surveys.

use super::path;
use super::photon_view::{self, PhotonView};
use super::{Borrower, Method, RenderSetup, Renderer};
use crate::render::RenderError;
use crate::render::audit::Audit;
use crate::render::cache_file::{self, Half, Header, Reader, View};
use crate::render::deadline::End;
use crate::render::held_out::EXACT;
use crate::render::memory::Memory;
use crate::render::rewritten_file::RewrittenFile;
use crate::render::survey::{self, Survey};
use crate::render::threads::{ThreadedRound, Threads, Workers};
use crate::save::Patience;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::IrradianceCache;
use halflight_core::findings::Decision::{LeftOut, Limited, Used};
use halflight_core::findings::{Finding, Findings, Value};
use halflight_core::memory::{Footprint, Line};
use halflight_core::method::cache_resolution::CachedPicture;
use halflight_core::method::caustics::{
    self, CausticEmission, CausticPhotons, CausticSettings, CausticUse, Decision, Prepass, least_footprint,
    prepass,
};
use halflight_core::method::irradiance_cache::{CacheSettings, FILLED, IrradianceCaching};
use halflight_core::method::path::PathTracing;
use halflight_core::method::record_placement::CacheBuilder;
use halflight_core::method::view_placement::RAYS;
use halflight_core::method::{LastMaps, Method as _};
use halflight_core::scene::{Material, Scene, Surface};
use halflight_core::transport::PathIntegrator;
use halflight_core::transport::cached::view;

/// Emission of caustic photons, if they pay and fit into memory besides the needs of `cache`.
fn find_caustics<'m, F: Features>(
    setup: &RenderSetup<'m>,
    memory: &mut Memory<'m>,
    cache: &CacheSettings,
) -> Result<(Option<CausticEmission<'m>>, CausticUse), RenderError> {
    let RenderSetup { workers, .. } = *setup;
    if !path::are_possible(setup) {
        return Ok((None, CausticUse::default()));
    }
    let needed = scratch::<F>(cache, true).bytes().saturating_mul(workers.count());
    // Memory is shared equally between records and photons.
    let reserved = needed.saturating_add(later(cache, setup.scene));
    let reserved = reserved.saturating_add(least_footprint().bytes());
    let scratch = caustics::scratch::<F>();
    if scratch.bytes().saturating_mul(workers.count()) > memory.available() {
        return Ok((None, CausticUse { lacks_memory: true, ..CausticUse::default() }));
    }
    let mut scratch = memory.take_each("paths", scratch, workers.count())?;
    let context = setup.context();
    let mut paths = PathTracing::<F>::plain(&context);
    let settings = CausticSettings { beside_records: true, reserved, most_rays: setup.most_rays() };
    let mut executor = Threads::new(workers, &mut scratch);
    let Prepass { decision, share, lacks_memory } =
        prepass(&context, &mut paths, settings, memory, &mut executor)?;
    drop(scratch);
    memory.give_back("paths");
    let emission = match decision {
        Decision::Photons(emission) => Some(emission),
        Decision::Paths => None,
    };
    let caustics = CausticUse { used: emission.is_some(), share, lacks_memory };
    Ok((emission, caustics))
}

/// Name of the memory of loaded records, until the caches hold them.
const LOADED: &str = "loaded records";

/// Irradiance caching at work.
pub(super) struct Cached<'m, F> {
    chosen: Method,
    method: IrradianceCaching<'m, F>,
    setup: RenderSetup<'m>,
    /// Caustic photons, if they pay.
    photons: Option<CausticPhotons<'m>>,
    caustics: CausticUse,
    scratch: Vec<Vec<Line>>,
    /// Number of held-out points, and working memory for gathering there.
    survey: Option<(u32, Vec<Vec<Line>>)>,
    /// Header for the cache file.
    header: Header,
    view: View,
    /// Counts of the loaded file.
    loaded: [Half; 2],
    /// File to which caches are written.
    kept: RewrittenFile<'m>,
}

impl<'m, F: Features> Cached<'m, F> {
    /// Runs the prepass for caustics, allocates memory and sets up the method.
    pub(super) fn new(
        (chosen, picture): (Method, Option<CachedPicture>),
        setup: &RenderSetup<'m>,
        memory: &mut Memory<'m>,
    ) -> Result<Self, RenderError> {
        let RenderSetup { scene, settings, workers, .. } = *setup;
        let file = cache_file::open(scene, settings, memory.for_file())?;
        let header = file.as_ref().map_or_else(|| Header::new(scene, settings), |file| file.header.clone());
        memory.set_aside(LOADED, Footprint::default().slice::<u8>(header.bytes() as usize))?;
        let loaded = file.map(Reader::load).transpose()?.unwrap_or_default();
        let fewest = loaded.iter().map(|half| half.records.len()).max().unwrap_or(0);
        let cache = CacheSettings { picture, ..core_settings::<F>(chosen, setup, fewest) };
        let (emission, caustics) = find_caustics::<F>(setup, memory, &cache)?;
        let scratch = scratch::<F>(&cache, emission.is_some());
        let scratch = memory.take_each("paths", scratch, workers.count())?;
        let photons = match emission {
            Some(emission) => {
                let reserved = later(&cache, scene);
                let settings =
                    CausticSettings { beside_records: true, reserved, most_rays: setup.most_rays() };
                CausticPhotons::new(&setup.context(), emission, settings, memory)?
            }
            None => None,
        };
        let mut method = IrradianceCaching::<F>::new(&setup.context(), &cache, memory)?;
        let exact = PathIntegrator::<F>::gather_scratch(EXACT);
        let needed = (exact.bytes() * workers.count()).saturating_add(cache.reserve);
        let survey = match settings.survey.filter(|_| memory.has(needed)) {
            Some(points) => Some((points, memory.take_each("survey", exact, workers.count())?)),
            None => None,
        };
        let view = View::of(scene, settings);
        let gathered = header.halves.map(|half| half.gathered);
        method.restore(loaded.each_ref().map(|half| &half.records[..]), gathered);
        method.restore_coefficients(
            loaded.each_ref().map(|half| (&half.coefficients[..], &half.registers[..])),
        );
        if header.serves(&view) {
            method.finish();
        }
        drop(loaded);
        memory.give_back(LOADED);
        Ok(Self {
            chosen,
            method,
            setup: *setup,
            photons,
            caustics,
            scratch,
            survey,
            view,
            loaded: header.halves,
            header,
            kept: RewrittenFile::in_file(settings.save_cache.as_deref()),
        })
    }

    /// Fills both caches or continues to, and writes them to their file.
    fn fill(&mut self, round: &mut ThreadedRound) -> Result<(), RenderError> {
        let Self { method, photons: maps, scratch, .. } = self;
        let mut all = true;
        for number in 0..FILLED {
            // With a limited depth gather rays use no photons.
            let asks = !method.is_filled(number) && !method.paths().is_limited();
            let photons = match maps.as_mut().filter(|_| asks) {
                Some(maps) => {
                    match round.run(scratch, |round| maps.for_records::<F, _>(number as u32 % 2, round))? {
                        Some(photons) => Some(photons),
                        None => {
                            all = false;
                            break;
                        }
                    }
                }
                None => None,
            };
            let merging = photons.as_ref().map(|photons| photons.merging());
            all = round.run(scratch, |round| method.fill(number, merging, round))?;
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

    /// Finding on the caches.
    fn finding(&self) -> Finding {
        let metric = self.setup.settings.cache.metric;
        let resolution = self.method.resolution();
        let caches = self.method.caches();
        let sum = |of: fn(&IrradianceCache) -> u64| caches.iter().map(|cache| of(cache)).sum::<u64>();
        let both = |halves: [u32; 2]| halves.into_iter().map(u64::from).sum::<u64>();
        let refused = sum(|cache| cache.refused());
        let may_be_coated = |material: &&Material| matches!(material.surface, Surface::Glossy { .. });
        let coats = self.setup.scene.materials.iter().filter(may_be_coated).count() as u64;
        let (decision, reason) = match (self.method.is_cut(), refused) {
            (true, _) => (Limited, "filling was cut short: other points are path traced"),
            (false, 1..) => (Limited, "not enough memory: other points are path traced"),
            (false, 0) if coats > 0 => {
                (Used, "indirect light of diffuse surfaces and of the bases of coats is interpolated")
            }
            (false, 0) => (Used, "indirect light of diffuse surfaces is interpolated"),
        };
        let gathered = both(self.method.gathered()) - both(self.loaded.map(|half| half.gathered));
        Finding::new("irradiance_cache", decision, reason)
            .timed("cache")
            .with("metric", Value::Name(metric.name()))
            .with("error", Value::Number(resolution.error.into()))
            .with("rays_per_record", Value::Count(resolution.strata.pow(2).into()))
            .with("records", Value::Count(sum(|cache| cache.records().len() as u64)))
            .with("capacity", Value::Count(sum(|cache| cache.capacity() as u64)))
            .with("gathered", Value::Count(gathered))
            .with_count("coated_materials", coats)
            .with_count("loaded", both(self.loaded.map(|half| half.records)))
            .with_count("refused", refused)
    }

    /// Finding on the lobes that records serve.
    fn lobe_finding(&self) -> Finding {
        let may_be_rough = |material: &&Material| material.surface.may_be_rough();
        let Some(gathering) = self.method.lobes() else {
            let rough = self.setup.scene.materials.iter().filter(may_be_rough).count() as u64;
            let reason = match rough {
                0 => "no surface has a rough reflection",
                _ => "the lobes are too narrow for coefficients",
            };
            return Finding::new("radiance_records", LeftOut, reason)
                .with_count("path_traced_materials", rough);
        };
        let (lobes, caches) = (gathering.lobes(), self.method.caches());
        let with_lobes = |cache: &IrradianceCache| {
            let records = cache.records().len();
            let found = cache.coefficients().map(|known| known.records(records));
            found.into_iter().flatten().filter(|record| record.is_some()).count() as u64
        };
        let census = lobes.census();
        let reason = match census.left {
            0 => "the light of rough reflections is interpolated",
            _ => "the light of wide lobes is interpolated",
        };
        Finding::new("radiance_records", Used, reason)
            .with("basis", Value::Name(lobes.representation().basis.name()))
            .with("degree", Value::Count(lobes.representation().degree as u64))
            .with("tolerance", Value::Number(self.setup.settings.lobes.tolerance.into()))
            .with("rays_per_record", Value::Count(gathering.rays() as u64))
            .with("records", Value::Count(caches.iter().map(|cache| with_lobes(cache)).sum()))
            .with_count("served_materials", census.served)
            .with_count("path_traced_materials", census.left)
    }

    /// Finding on the narrow lobes that the camera sees.
    fn view_finding(&self) -> Finding {
        const TOPIC: &str = "view_bound_records";
        let Some(views) = self.method.views() else {
            let reason = match view::may_serve(self.setup.scene) {
                true => "not enough memory, or too short paths: narrow lobes are path traced",
                false => "no surface has a narrow lobe, of alpha 0.05 to 0.5",
            };
            return Finding::new(TOPIC, LeftOut, reason);
        };
        let records = views.iter().map(|records| records.records().len() as u64).sum::<u64>();
        let (decision, reason) = match (records, self.method.is_view_cut()) {
            (0, _) => (LeftOut, "the camera sees no narrow lobe on a flat surface"),
            (_, true) => (Limited, "filling was cut short: other narrow lobes are path traced"),
            (_, false) => (Used, "light that narrow lobes reflect to the camera is interpolated"),
        };
        Finding::new(TOPIC, decision, reason)
            .with("rays_per_record", Value::Count(RAYS as u64))
            .with("records", Value::Count(records))
    }

    /// Writes the file during the render, or at the end if a write is outstanding.
    fn keep(&mut self, last: Option<Patience>) {
        let caches = self.method.caches();
        for ((half, cache), gathered) in self.header.halves.iter_mut().zip(caches).zip(self.method.gathered())
        {
            *half = Half::of(cache, gathered);
        }
        let header = &self.header;
        self.kept.keep(last, |path, patience| cache_file::write(path, header, caches, patience));
    }
}

impl<F: Features> Renderer for Cached<'_, F> {
    fn chosen(&self) -> Method {
        self.chosen
    }

    fn round(&mut self, round: &mut ThreadedRound) -> Result<(), RenderError> {
        if !self.method.is_frozen() {
            // A resumed film has counted the rays of filling already.
            let is_resumed = round.state.spp() > 0;
            let counted = round.state.counters;
            self.fill(round)?;
            if !self.method.is_frozen() {
                return Ok(());
            }
            if is_resumed {
                round.state.counters = counted;
            }
        }
        let Self { method, photons, scratch, .. } = self;
        Ok(round.run(scratch, |round| match photons {
            Some(photons) => photons.round(&method.cached_paths(), round),
            None => method.round(round),
        })?)
    }

    fn lend_photons(&mut self, then: &mut Borrower) -> Result<(), RenderError> {
        path::lend(self.photons.as_mut(), then)
    }

    fn risks(&mut self, workers: &Workers) -> Result<Vec<f32>, RenderError> {
        let settings = self.setup.settings;
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
        let settings = self.setup.settings;
        let size = [settings.width, settings.height];
        let executor = Threads::new(workers, scratch);
        survey::survey(self.method.paths(), caches, size, (*points, settings.stop.seconds), executor)
    }

    fn finish(&mut self, patience: Patience) {
        self.keep(Some(patience));
    }

    fn kept(&self) -> Option<&RewrittenFile<'_>> {
        Some(&self.kept)
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        let Some(photons) = &mut self.photons else { return Ok(None) };
        let maps = LastMaps { global: None, caustic: photons.last_map()? };
        Ok(photon_view::render::<F>(&self.setup, &maps)?)
    }

    fn findings(&self) -> Findings {
        let photons = self.photons.as_ref().map(|photons| photons.statistics());
        let is_radiance = self.chosen == Method::RadianceCache;
        let lobes = is_radiance.then(|| self.lobe_finding());
        let views = is_radiance.then(|| self.view_finding());
        Findings::from(self.finding()).and(lobes).and(views).and(self.caustics.findings(photons))
    }
}

/// Settings of a picture's caches with room for at least `fewest` records each.
fn core_settings<F: Features>(chosen: Method, setup: &RenderSetup, fewest: usize) -> CacheSettings {
    let RenderSetup { settings, .. } = *setup;
    CacheSettings {
        metric: settings.cache.metric,
        error: settings.cache.allowed(),
        strata: settings.cache.strata() as usize,
        fewest,
        reserve: Audit::bytes::<F>(setup, chosen.is_biased()),
        // Records saved to a file keep their validity radii.
        widens: settings.save_cache.is_none(),
        lobes: (chosen == Method::RadianceCache).then_some(settings.lobes),
        picture: None,
    }
}

/// Working memory of a thread, with or without caustic photons.
fn scratch<F: Features>(cache: &CacheSettings, has_caustics: bool) -> Footprint {
    let scratch = IrradianceCaching::<F>::scratch(cache);
    if has_caustics { scratch.or(caustics::scratch::<F>()) } else { scratch }
}

/// Bytes to leave when caustic photons take memory: for tables, for the fewest records of each cache, and for
/// the audit.
fn later(cache: &CacheSettings, scene: &Scene) -> usize {
    let records = CacheBuilder::footprint(cache.fewest, cache.representation()).bytes().saturating_mul(2);
    let tables = cache.gathering_footprint().and(cache.lobe_footprint(scene)).bytes();
    records.saturating_add(tables).saturating_add(cache.reserve)
}
