//! Files and surveys of the caches of a picture.

use crate::render::audit::ThreadedAudit;
use crate::render::files::{self, CacheHeader, Half, Loaded, RewrittenFile, View};
use crate::render::held_out::EXACT;
use crate::render::memory::Memory;
use crate::render::setup::RenderSetup;
use crate::render::survey::{self, Survey};
use crate::render::threads::Threads;
use crate::render::{Method, RenderError};
use crate::save::Patience;
use halflight_core::bsdf::Features;
use halflight_core::memory::{Footprint, Line};
use halflight_core::method::cached_paths::{CachedPathTracing, KeptCaches, KeptRecords};
use halflight_core::transport::PathIntegrator;

/// Name of the memory of loaded records, until the caches hold them.
const LOADED: &str = "loaded records";

/// Records of a file, for caches to begin with.
pub(super) struct LoadedCaches {
    halves: [Loaded; 2],
    header: CacheHeader,
    view: View,
}

impl LoadedCaches {
    /// Records of the file that the settings name; none of a method without records.
    pub(super) fn open(
        method: Method,
        setup: &RenderSetup,
        memory: &mut Memory,
    ) -> Result<Self, RenderError> {
        let RenderSetup { scene, settings, .. } = *setup;
        let view = View::of(scene, settings);
        if !method.has_records() {
            return Ok(Self { halves: Default::default(), header: CacheHeader::new(scene, settings), view });
        }
        let file = files::open_cache(scene, settings, memory.for_file())?;
        let header =
            file.as_ref().map_or_else(|| CacheHeader::new(scene, settings), |file| file.header.clone());
        memory.set_aside(LOADED, Footprint::default().slice::<u8>(header.bytes() as usize))?;
        let halves = file.map(|file| file.load()).transpose()?.unwrap_or_default();
        Ok(Self { halves, header, view })
    }

    /// The records for a method.
    pub(super) fn kept(&self) -> KeptCaches<'_> {
        let kept = |i: usize| KeptRecords {
            records: &self.halves[i].records,
            gathered: self.header.halves[i].gathered,
            coefficients: &self.halves[i].coefficients,
            registers: &self.halves[i].registers,
        };
        KeptCaches { halves: [kept(0), kept(1)], is_complete: self.header.serves(&self.view) }
    }
}

/// Keeper of the caches of a picture.
pub(super) struct CacheKeeper<'m> {
    header: CacheHeader,
    view: View,
    /// File to which caches are written.
    pub(super) file: RewrittenFile<'m>,
    /// Number of held-out points, and working memory for gathering there.
    survey: Option<(u32, Vec<Vec<Line>>)>,
    /// True once complete caches were written.
    is_frozen: bool,
}

impl<'m> CacheKeeper<'m> {
    /// Keeper of caches that began with the records of `loaded`, which the caches hold now.
    pub(super) fn new<F: Features>(
        loaded: LoadedCaches,
        setup: &RenderSetup<'m>,
        memory: &mut Memory,
    ) -> Result<Self, RenderError> {
        let RenderSetup { settings, workers, .. } = *setup;
        memory.give_back(LOADED);
        let exact = PathIntegrator::<F>::gather_scratch(EXACT);
        let reserve = ThreadedAudit::<F>::bytes(setup, true);
        let needed = (exact.bytes() * workers.count()).saturating_add(reserve);
        let survey = match settings.survey.filter(|_| memory.has(needed)) {
            Some(points) => Some((points, memory.take_each("survey", exact, workers.count())?)),
            None => None,
        };
        let LoadedCaches { header, view, .. } = loaded;
        let file = RewrittenFile::in_file(settings.save_cache.as_deref());
        Ok(Self { header, view, file, survey, is_frozen: false })
    }

    /// Writes the file after the round that has filled the caches or continued to.
    pub(super) fn after_round<F: Features>(&mut self, cached: &CachedPathTracing<F>) {
        if self.is_frozen {
            return;
        }
        let caching = cached.caching();
        self.is_frozen = caching.is_frozen();
        if self.is_frozen && !caching.is_cut() {
            self.header.is_filled_for(self.view.clone());
        }
        self.keep(cached, None);
    }

    /// Writes the file during the render, or at the end if a write is outstanding.
    pub(super) fn keep<F: Features>(&mut self, cached: &CachedPathTracing<F>, last: Option<Patience>) {
        let (caches, gathered) = (cached.caching().caches(), cached.caching().gathered());
        for ((half, cache), gathered) in self.header.halves.iter_mut().zip(caches).zip(gathered) {
            *half = Half::of(cache, gathered);
        }
        let header = &self.header;
        self.file.keep(last, |path, patience| files::write_cache(path, header, caches, patience));
    }

    /// Survey of the caches, if the settings ask for one.
    pub(super) fn survey<F: Features>(
        &mut self,
        cached: &CachedPathTracing<F>,
        setup: &RenderSetup,
    ) -> Result<Option<Survey>, RenderError> {
        let Some((points, scratch)) = &mut self.survey else { return Ok(None) };
        let caching = cached.caching();
        if caching.caches().iter().all(|cache| cache.records().is_empty()) {
            return Ok(None);
        }
        let settings = setup.settings;
        let size = [settings.width, settings.height];
        let executor = Threads::new(setup.workers, scratch);
        let extent = (*points, settings.stop.seconds);
        survey::survey(caching.paths(), caching.caches(), size, extent, executor)
    }
}
