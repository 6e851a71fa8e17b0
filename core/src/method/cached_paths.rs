//! Irradiance and radiance caching, joined with caustic photons where a prepass finds that they pay.

use super::caustics::{
    self, CausticEmission, CausticPhotons, CausticSettings, CausticUse, Decision, Prepass, least_footprint,
    prepass,
};
use super::executor::Executor;
use super::irradiance_cache::{CacheSettings, FILLED, IrradianceCaching};
use super::path::PathTracing;
use super::record_placement::CacheBuilder;
use super::view_placement::RAYS;
use super::{LastMaps, RenderContext, RenderMethod, Round};
use crate::bsdf::Features;
use crate::cache::irradiance::{IrradianceCache, Record};
use crate::cache::radiance::PooledRecord;
use crate::findings::Decision::{LeftOut, Limited, Used};
use crate::findings::{Finding, Findings, Value};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::scene::{Material, Scene, Surface};
use crate::transport::cached::view;

/// Records of a cache of an earlier render of the scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct KeptRecords<'r> {
    /// Records.
    pub records: &'r [Record],
    /// Points at which light was gathered for them.
    pub gathered: u32,
    /// Coefficients of the records.
    pub coefficients: &'r [PooledRecord],
    /// Registers of the coefficients.
    pub registers: &'r [[u16; 16]],
}

/// Records to begin with, of even and of odd samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct KeptCaches<'r> {
    /// Records of both halves.
    pub halves: [KeptRecords<'r>; 2],
    /// True if no record is to be added.
    pub is_complete: bool,
}

/// Irradiance caching at work.
pub struct CachedPathTracing<'a, F> {
    context: RenderContext<'a>,
    settings: CacheSettings,
    cached: IrradianceCaching<'a, F>,
    /// Caustic photons, if they pay.
    photons: Option<CausticPhotons<'a>>,
    caustics: CausticUse,
    /// Counts of the records at the start: points gathered, and records.
    kept: [u64; 2],
}

impl<'a, F: Features> CachedPathTracing<'a, F> {
    /// Working memory of a worker, with or without caustic photons.
    pub fn scratch(settings: &CacheSettings, has_caustics: bool) -> Footprint {
        let scratch = IrradianceCaching::<F>::scratch(settings);
        if has_caustics { scratch.or(caustics::scratch::<F>()) } else { scratch }
    }

    /// Caching for `context` that begins with the records of `kept`. A prepass for caustic photons runs
    /// within the rays of the picture, or there are no `photons`.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` has too little for the tables and [`CacheSettings::fewest`] records, or
    /// the executor's scratch is smaller than [`CachedPathTracing::scratch`].
    pub fn new(
        context: &RenderContext<'a>,
        settings: CacheSettings,
        (kept, photons): (&KeptCaches, Result<Option<f64>, CausticUse>),
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, OutOfMemory> {
        let fewest = kept.halves.iter().map(|half| half.records.len()).max().unwrap_or(0);
        let settings = CacheSettings { fewest: settings.fewest.max(fewest), ..settings };
        let later = least_memory(&settings, context.scene);
        let (emission, mut caustics) = match photons {
            Ok(most_rays) => {
                // Memory is shared equally between records and photons.
                let reserved = later.saturating_add(least_footprint().bytes());
                let settings = CausticSettings { beside_records: true, reserved, most_rays };
                find_caustics::<F>(context, settings, memory, executor)?
            }
            Err(without) => (None, without),
        };
        let most_rays = photons.unwrap_or(None);
        let photons = match emission {
            Some(emission) => {
                let settings = CausticSettings { beside_records: true, reserved: later, most_rays };
                CausticPhotons::new(context, emission, settings, memory)?
            }
            None => None,
        };
        caustics.lacks_memory |= caustics.used && photons.is_none();
        let mut cached = IrradianceCaching::<F>::new(context, &settings, memory)?;
        let halves = &kept.halves;
        cached.restore(halves.each_ref().map(|half| half.records), halves.map(|half| half.gathered));
        cached.restore_coefficients(halves.each_ref().map(|half| (half.coefficients, half.registers)));
        if kept.is_complete {
            cached.finish();
        }
        let sum = |of: fn(&KeptRecords) -> u64| halves.iter().map(of).sum::<u64>();
        let kept = [sum(|half| half.gathered.into()), sum(|half| half.records.len() as u64)];
        Ok(Self { context: *context, settings, cached, photons, caustics, kept })
    }

    /// The caches and their paths.
    pub fn caching(&self) -> &IrradianceCaching<'a, F> {
        &self.cached
    }

    /// The caustic photons, if they pay.
    pub fn photons(&mut self) -> Option<&mut CausticPhotons<'a>> {
        self.photons.as_mut()
    }

    /// Fills all structures, or continues to. Returns whether they are complete.
    fn fill<E: Executor>(&mut self, round: &mut Round<E>) -> Result<bool, OutOfMemory> {
        let Self { cached, photons: maps, .. } = self;
        for number in 0..FILLED {
            // With a limited depth gather rays use no photons.
            let asks = !cached.is_filled(number) && !cached.paths().is_limited();
            let photons = match maps.as_mut().filter(|_| asks) {
                Some(maps) => match maps.for_records::<F, _>(number as u32 % 2, round)? {
                    Some(photons) => Some(photons),
                    None => return Ok(false),
                },
                None => None,
            };
            let merging = photons.as_ref().map(|photons| photons.merging());
            if !cached.fill(number, merging, round)? {
                return Ok(false);
            }
        }
        cached.freeze();
        Ok(true)
    }

    /// Finding on the caches.
    fn finding(&self) -> Finding {
        let resolution = self.cached.resolution();
        let caches = self.cached.caches();
        let sum = |of: fn(&IrradianceCache) -> u64| caches.iter().map(|cache| of(cache)).sum::<u64>();
        let refused = sum(|cache| cache.refused());
        let may_be_coated = |material: &&Material| matches!(material.surface, Surface::Glossy { .. });
        let coats = self.context.scene.materials.iter().filter(may_be_coated).count() as u64;
        let (decision, reason) = match (self.cached.is_cut(), refused) {
            (true, _) => (Limited, "filling was cut short: other points are path traced"),
            (false, 1..) => (Limited, "not enough memory: other points are path traced"),
            (false, 0) if coats > 0 => {
                (Used, "indirect light of diffuse surfaces and of the bases of coats is interpolated")
            }
            (false, 0) => (Used, "indirect light of diffuse surfaces is interpolated"),
        };
        let [gathered, loaded] = self.kept;
        let gathered = self.cached.gathered().into_iter().map(u64::from).sum::<u64>() - gathered;
        Finding::new("irradiance_cache", decision, reason)
            .timed("cache")
            .with("metric", Value::Name(self.settings.metric.name()))
            .with("error", Value::Number(resolution.error.into()))
            .with("rays_per_record", Value::Count(resolution.strata.pow(2).into()))
            .with("records", Value::Count(sum(|cache| cache.records().len() as u64)))
            .with("capacity", Value::Count(sum(|cache| cache.capacity() as u64)))
            .with("gathered", Value::Count(gathered))
            .with_count("coated_materials", coats)
            .with_count("loaded", loaded)
            .with_count("refused", refused)
    }

    /// Finding on the lobes that records serve with a `tolerance`.
    fn lobe_finding(&self, tolerance: f32) -> Finding {
        let Some(gathering) = self.cached.lobes() else {
            let may_be_rough = |material: &&Material| material.surface.may_be_rough();
            let rough = self.context.scene.materials.iter().filter(may_be_rough).count() as u64;
            let reason = match rough {
                0 => "no surface has a rough reflection",
                _ => "the lobes are too narrow for coefficients",
            };
            return Finding::new("radiance_records", LeftOut, reason)
                .with_count("path_traced_materials", rough);
        };
        let (lobes, caches) = (gathering.lobes(), self.cached.caches());
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
            .with("tolerance", Value::Number(tolerance.into()))
            .with("rays_per_record", Value::Count(gathering.rays() as u64))
            .with("records", Value::Count(caches.iter().map(|cache| with_lobes(cache)).sum()))
            .with_count("served_materials", census.served)
            .with_count("path_traced_materials", census.left)
    }

    /// Finding on the narrow lobes that the camera sees.
    fn view_finding(&self) -> Finding {
        const TOPIC: &str = "view_bound_records";
        let Some(views) = self.cached.views() else {
            let reason = match view::may_serve(self.context.scene) {
                true => "not enough memory, or too short paths: narrow lobes are path traced",
                false => "no surface has a narrow lobe, of alpha 0.05 to 0.5",
            };
            return Finding::new(TOPIC, LeftOut, reason);
        };
        let records = views.iter().map(|records| records.records().len() as u64).sum::<u64>();
        let (decision, reason) = match (records, self.cached.is_view_cut()) {
            (0, _) => (LeftOut, "the camera sees no narrow lobe on a flat surface"),
            (_, true) => (Limited, "filling was cut short: other narrow lobes are path traced"),
            (_, false) => (Used, "light that narrow lobes reflect to the camera is interpolated"),
        };
        Finding::new(TOPIC, decision, reason)
            .with("rays_per_record", Value::Count(RAYS as u64))
            .with("records", Value::Count(records))
    }
}

impl<F: Features> RenderMethod for CachedPathTracing<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        if !self.cached.is_frozen() {
            // A resumed film has counted the rays of filling already.
            let is_resumed = round.state.spp() > 0;
            let counted = round.state.counters;
            if !self.fill(round)? {
                return Ok(());
            }
            if is_resumed {
                round.state.counters = counted;
            }
        }
        match &mut self.photons {
            Some(photons) => photons.round(&self.cached.cached_paths(), round),
            None => self.cached.round(round),
        }
    }

    fn findings(&self) -> Findings {
        let photons = self.photons.as_ref().map(|photons| photons.statistics());
        let lobes = self.settings.lobes.map(|lobes| self.lobe_finding(lobes.tolerance));
        let views = self.settings.lobes.map(|_| self.view_finding());
        Findings::from(self.finding()).and(lobes).and(views).and(self.caustics.findings(photons))
    }

    fn last_maps(&mut self) -> Result<LastMaps<'_>, OutOfMemory> {
        let caustic = self.photons.as_mut().map_or(Ok(None), CausticPhotons::last_map)?;
        Ok(LastMaps { global: None, caustic })
    }
}

/// Emission of caustic photons, if they pay and fit into memory.
fn find_caustics<'a, F: Features>(
    context: &RenderContext<'a>,
    settings: CausticSettings,
    memory: &mut impl MemorySource<'a>,
    executor: &mut impl Executor,
) -> Result<(Option<CausticEmission<'a>>, CausticUse), OutOfMemory> {
    let mut paths = PathTracing::<F>::plain(context);
    let Prepass { decision, share, lacks_memory } = prepass(context, &mut paths, settings, memory, executor)?;
    let emission = match decision {
        Decision::Photons(emission) => Some(emission),
        Decision::Paths => None,
    };
    let used = emission.is_some();
    Ok((emission, CausticUse { used, share, lacks_memory }))
}

/// Bytes to leave when caustic photons take memory: for tables, for the fewest records of each cache, and for
/// other structures.
pub(super) fn least_memory(settings: &CacheSettings, scene: &Scene) -> usize {
    let records = CacheBuilder::footprint(settings.fewest, settings.representation()).bytes();
    let tables = settings.gathering_footprint().and(settings.lobe_footprint(scene)).bytes();
    records.saturating_mul(2).saturating_add(tables).saturating_add(settings.reserve)
}
