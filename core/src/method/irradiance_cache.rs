//! Irradiance caching (Ward, Rubinstein and Clear 1988): the indirect light of diffuse surfaces is gathered
//! at few points and interpolated between them, also under coats. Paths find all other light.
//!
//! One cache serves the even samples, another the odd ones, and each is filled without the other: the
//! difference of the halves of the film shows the errors of records too. First both caches are filled, then
//! they are frozen. Paths go on where no record is valid.

mod part;
mod settings;

pub use settings::CacheSettings;

use super::cache_resolution::{CacheResolution, CachedPicture};
use super::executor::{Executor, Passed};
use super::record_placement::{CacheBuilder, LobeGathering, PlaceSource, RecordPlacement, step_points};
use super::view_placement::{ViewPlacement, Views};
use super::{RenderContext, RenderMethod, Round};
use crate::bsdf::Features;
use crate::cache::irradiance::{CellFlux, IrradianceCache, Record, metric};
use crate::cache::radiance::{PooledRecord, ServedLobes};
use crate::cache::view::ViewRecords;
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::transport::cached::gather::GatherPoint;
use crate::transport::cached::point_places::PointPlaces;
use crate::transport::{CacheView, CausticMerging, PathIntegrator, path::WAVE};

/// Least radius of a record in pixels: the distance of neighbours among the pixels that placement visits.
pub const LEAST_PIXELS: f32 = 2.0;

/// Fraction of the time for each of both caches, of the time that is left before the first is filled: both
/// are cut alike. Points that no record reaches by then are path traced. A smaller fraction leaves more to
/// paths where filling is slow (docs/decisions/cache-lookups.md#deadline).
const TIME: f32 = 0.18;

/// The same for each half of the view-bound records, of the time that is left when the caches are filled.
const VIEW_TIME: f32 = 0.1;

/// Structures that [`IrradianceCaching::fill`] fills: two caches, and view-bound records beside each.
pub const FILLED: usize = 4;

/// Choice of a finer resolution after the first cache is filled.
struct Finer<'a> {
    picture: CachedPicture,
    /// Triangles of the scene.
    triangles: usize,
    /// Tables of [`CacheResolution::FINEST`].
    flux: [CellFlux<'a>; 2],
    /// Rays of the first cache.
    rays: u64,
}

/// Irradiance caching of one picture.
pub struct IrradianceCaching<'a, F> {
    integrator: PathIntegrator<'a, F>,
    metric: metric::Settings,
    /// Tables of the strata of records, and of those behind rough surfaces.
    flux: [CellFlux<'a>; 2],
    finer: Option<Finer<'a>>,
    /// Resolution of the records.
    resolution: CacheResolution,
    size: [u32; 2],
    /// Points that take the place of the pixels.
    points: Option<PointPlaces<'a>>,
    builders: [CacheBuilder<'a>; 2],
    step: &'a mut [GatherPoint],
    lobes: Option<LobeGathering<'a>>,
    views: Option<Views<'a>>,
    widens: bool,
    is_frozen: bool,
    is_cut: bool,
}

impl<'a, F: Features> IrradianceCaching<'a, F> {
    /// Working memory of a worker, for paths and for gather rays, both with photons of caustics.
    pub fn scratch(settings: &CacheSettings) -> Footprint {
        let gathering = PathIntegrator::<F>::gather_scratch_with::<((), CausticMerging)>(
            settings.most_strata().max(settings.lobe_strata()),
        );
        let gathering = match settings.lobes {
            Some(_) if F::GLOSSY => gathering.or(PathIntegrator::<F>::view_scratch::<((), CausticMerging)>()),
            _ => gathering,
        };
        PathIntegrator::<F>::scratch_with::<((), CausticMerging), ()>(WAVE).or(gathering)
    }

    /// Irradiance caching of `context`, with empty caches.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` has too little for the tables and [`CacheSettings::fewest`] records.
    pub fn new(
        context: &RenderContext<'a>,
        settings: &CacheSettings,
        memory: &mut impl MemorySource<'a>,
    ) -> Result<Self, OutOfMemory> {
        let mut arena = memory.take("gathering", settings.gathering_footprint())?;
        let mut tables = |strata| {
            let [seen, behind_rough] = CacheSettings::strata_of(strata);
            Ok::<_, OutOfMemory>([
                CellFlux::build(seen, &mut arena)?,
                CellFlux::build(behind_rough, &mut arena)?,
            ])
        };
        let flux = tables(settings.strata)?;
        let finer = match settings.picture {
            Some(picture) => {
                let triangles = context.scene.mesh.triangles.len();
                Some(Finer { picture, triangles, flux: tables(settings.most_strata())?, rays: 0 })
            }
            None => None,
        };
        let step = step_points(&mut arena)?;
        let lobes = match &settings.lobes {
            Some(lobes) if F::GLOSSY => {
                let mut arena = memory.take("radiance", settings.lobe_footprint(context.scene))?;
                let served = ServedLobes::build(context.scene, lobes, &mut arena)?;
                served
                    .map(|served| LobeGathering::new(served, settings.lobe_strata(), &mut arena))
                    .transpose()?
            }
            _ => None,
        };
        let served = lobes.as_ref().map(|gathering| *gathering.lobes());
        let representation = served.as_ref().map(ServedLobes::representation);

        let views = match settings.lobes {
            Some(_) if F::GLOSSY => {
                let records =
                    CacheBuilder::footprint(settings.fewest, representation).bytes().saturating_mul(2);
                Views::new(context, settings.reserve.saturating_add(records), memory)?
            }
            _ => None,
        };
        let available = memory.available().saturating_sub(settings.reserve);
        let wanted = settings.records(context.pixels()).saturating_add(settings.fewest);
        let capacity =
            wanted.min(CacheBuilder::capacity_of(available / 2, representation)).max(settings.fewest);
        let bounds = context.bvh.bounds();
        let mut builder = |index| {
            let mut arena = memory.take("cache", CacheBuilder::footprint(capacity, representation))?;
            CacheBuilder::new(&bounds, capacity, index, served, &mut arena)
        };
        let builders = [builder(0)?, builder(1)?];
        let usual = metric::Settings::new(settings.metric, 0.5 * bounds.diagonal());
        let mut method = Self {
            integrator: context.integrator(),
            metric: metric::Settings { error: settings.error, ..usual },
            flux,
            finer,
            resolution: CacheResolution { strata: settings.strata as u32, error: settings.error },
            size: [context.settings.width, context.settings.height],
            points: None,
            builders,
            step,
            lobes,
            views,
            widens: settings.widens,
            is_frozen: false,
            is_cut: false,
        };
        // No surface reflects light onto the one that is seen.
        if context.settings.max_depth <= 2 {
            method.finish();
            method.views = None;
            method.finer = None;
        }
        Ok(method)
    }

    /// Places the records for these points and not for what the camera sees.
    pub fn for_points(self, points: PointPlaces<'a>) -> Self {
        Self { points: Some(points), ..self }
    }

    /// Gather rays and density of the records.
    pub fn resolution(&self) -> CacheResolution {
        self.resolution
    }

    /// Begins with the records of other caches of the scene, for which light was gathered at `gathered`
    /// points.
    pub fn restore(&mut self, records: [&[Record]; 2], gathered: [u32; 2]) {
        for ((builder, records), gathered) in self.builders.iter_mut().zip(records).zip(gathered) {
            builder.restore(records, gathered);
        }
    }

    /// Restores coefficients of the records of [`IrradianceCaching::restore`], and their registers.
    pub fn restore_coefficients(&mut self, coefficients: [(&[PooledRecord], &[[u16; 16]]); 2]) {
        for (builder, (records, registers)) in self.builders.iter_mut().zip(coefficients) {
            builder.cache.restore_coefficients(records, registers);
        }
    }

    /// Leaves the caches as they are.
    pub fn finish(&mut self) {
        self.builders.iter_mut().for_each(CacheBuilder::finish);
    }

    /// The caches of even and of odd samples.
    pub fn caches(&self) -> [&IrradianceCache<'a>; 2] {
        self.builders.each_ref().map(|builder| &builder.cache)
    }

    /// Gathering of records that serve lobes, if the scene has such lobes.
    pub fn lobes(&self) -> Option<&LobeGathering<'a>> {
        self.lobes.as_ref()
    }

    /// Points at which light was gathered for each of them.
    pub fn gathered(&self) -> [u32; 2] {
        self.builders.each_ref().map(CacheBuilder::gathered)
    }

    /// True if both are frozen.
    pub fn is_frozen(&self) -> bool {
        self.is_frozen
    }

    /// True if there was no time to fill them.
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// Paths that ask no cache.
    pub fn paths(&self) -> &PathIntegrator<'a, F> {
        &self.integrator
    }

    /// View-bound records of even and of odd samples, if the scene has narrow lobes.
    pub fn views(&self) -> Option<[&ViewRecords<'a>; 2]> {
        self.views.as_ref().map(|views| views.builders.each_ref().map(|builder| &builder.records))
    }

    /// True if there was no time for all view-bound records.
    pub fn is_view_cut(&self) -> bool {
        self.views.as_ref().is_some_and(|views| views.is_cut)
    }

    /// Paths of the picture.
    pub fn cached_paths(&self) -> PathIntegrator<'_, F, CacheView<'_>> {
        match self.views() {
            Some(views) => self.integrator.with_views(self.caches(), views),
            None => self.integrator.with_caches(self.caches()),
        }
    }

    /// True if structure `number` is as it will be: see [`IrradianceCaching::fill`].
    pub fn is_filled(&self, number: usize) -> bool {
        match self.builders.get(number) {
            Some(builder) => builder.is_finished(),
            None => self.views.as_ref().is_none_or(|views| views.builders[number % 2].is_finished()),
        }
    }

    /// Fills structure `number` of [`FILLED`], or goes on with it: the caches of even and of odd samples, and
    /// the view-bound records of both. Gather rays end in `photons`, which paths of limited depth must not
    /// ask for. Returns whether that is done.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is too small.
    pub fn fill<E: Executor>(
        &mut self,
        number: usize,
        photons: Option<CausticMerging>,
        round: &mut Round<E>,
    ) -> Result<bool, OutOfMemory> {
        let Some(builder) = self.builders.get_mut(number) else {
            return self.fill_views(number % 2, photons, round);
        };
        let mut placement = RecordPlacement {
            integrator: &self.integrator,
            photons,
            flux: self.flux.each_ref(),
            metric: self.metric,
            least_pixels: LEAST_PIXELS,
            source: self.points.map_or(PlaceSource::Picture(self.size), PlaceSource::Points),
            step: &mut *self.step,
            lobes: self.lobes.as_mut(),
        };
        let Round { executor, state, .. } = round;
        let Passed { counters, is_complete } = executor.timed("cache", |executor| {
            let fraction = TIME / (1.0 - TIME * number as f32);
            executor.within(fraction, |executor| placement.fill(builder, executor))
        })?;
        state.counters += counters;
        if let Some(finer) = &mut self.finer {
            finer.rays += counters.all_rays();
        }
        let is_over = executor.is_over();
        if !is_complete && !is_over {
            if self.widens {
                state.counters += placement.widen(builder, *executor)?.counters;
            }
            builder.finish();
            self.is_cut = true;
        }
        if is_complete && number == 0 && self.refines() {
            return self.fill(0, photons, round);
        }
        Ok(is_complete || !is_over)
    }

    /// Empties the first cache if the picture gains by finer ones, and returns whether it does.
    fn refines(&mut self) -> bool {
        let Some(Finer { picture, triangles, flux, rays }) = self.finer.take() else { return false };
        let resolution = picture.resolution(CachedPicture::filling_of(2 * rays, triangles));
        if resolution == self.resolution {
            return false;
        }
        if resolution.strata != self.resolution.strata {
            self.flux = flux;
        }
        self.metric.error = resolution.error;
        self.resolution = resolution;
        self.builders.iter_mut().for_each(CacheBuilder::clear);
        true
    }

    /// Fills the view-bound records of half `number`, after both caches.
    fn fill_views<E: Executor>(
        &mut self,
        number: usize,
        photons: Option<CausticMerging>,
        round: &mut Round<E>,
    ) -> Result<bool, OutOfMemory> {
        let Some(views) = &mut self.views else { return Ok(true) };
        let builder = &mut views.builders[number];
        if builder.is_finished() {
            return Ok(true);
        }
        let irradiance = &mut self.builders[number].cache;
        irradiance.rebuild();
        let mut placement = ViewPlacement {
            integrator: &self.integrator,
            irradiance,
            photons,
            metric: self.metric,
            size: self.size,
            step: &mut *views.step,
        };
        let Round { executor, state, .. } = round;
        let Passed { counters, is_complete } = executor.timed("cache", |executor| {
            let fraction = VIEW_TIME / (1.0 - VIEW_TIME * number as f32);
            executor.within(fraction, |executor| placement.fill(builder, executor))
        })?;
        state.counters += counters;
        if is_complete || executor.is_over() {
            return Ok(is_complete);
        }
        builder.finish();
        views.is_cut = true;
        Ok(true)
    }

    /// Ends the filling of all structures.
    pub fn freeze(&mut self) {
        self.builders.iter_mut().for_each(|builder| builder.cache.rebuild());
        let views = self.views.iter_mut().flat_map(|views| &mut views.builders);
        views.for_each(|builder| builder.records.rebuild());
        self.is_frozen = true;
    }
}

impl<F: Features> RenderMethod for IrradianceCaching<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        if !self.is_frozen {
            for number in 0..FILLED {
                if !self.fill(number, None, round)? {
                    return Ok(());
                }
            }
            self.freeze();
        }
        let integrator = self.cached_paths();
        round.tiles(u32::MAX, |tile, samples, scratch, pixels| {
            integrator.run(tile, samples, WAVE, scratch, pixels)
        })
    }
}

#[cfg(test)]
mod tests;
