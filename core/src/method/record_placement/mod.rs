//! Placement of the records of an irradiance cache, from coarse to fine (Krivanek, Bouatouch, Pattanaik and
//! Zara 2006, section 5).
//!
//! The pixels of the picture come in an order that is spread evenly from its first pixel on. Where no record
//! is valid, light is gathered, and the new records are committed in the order of their pixels. Sweeps are
//! repeated: first for diffuse points that are seen directly or through mirrors and glass, then for those
//! behind rough surfaces.

pub(super) mod builder;
mod source;

pub use builder::CacheBuilder;
pub use source::PlaceSource;

use super::executor::{Executor, Passed};
use crate::bsdf::Features;
use crate::cache::irradiance::{CellFlux, metric};
use crate::cache::radiance::{GatherTables, Representation, ServedLobes};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::cached::gather::{GatherPoint, Gathering};
use crate::transport::cached::lobe::CoefficientGathering;
use crate::transport::cached::placement::{PIXELS, Via};
use crate::transport::{CausticMerging, Counters, PathIntegrator};

/// Pixels of a step: those of 16 tasks of [`PIXELS`].
const STEP: usize = 16 * PIXELS;

/// Gather points between two commits: a part of the records, within these limits. The first records soon
/// serve others.
pub(super) const POINTS_PER_COMMIT: PointsPerCommit = PointsPerCommit { fewest: 8, most: MOST_POINTS };
const MOST_POINTS: usize = 32;
const POINTS_PER_RECORD: usize = 4;

/// The records of a cache that had no time become wider, at most this many times, until they serve this share
/// of what such records could serve.
const WIDEST: f32 = 6.0;
const NEARLY_ALL: f64 = 0.98;

/// Limits of the points between two commits.
pub(super) struct PointsPerCommit {
    fewest: usize,
    pub(super) most: usize,
}

impl PointsPerCommit {
    /// Points to gather at after `records` records.
    pub(super) fn of(&self, records: usize) -> usize {
        (records / POINTS_PER_RECORD).clamp(self.fewest, self.most)
    }
}

/// Bytes of [`step_points`].
pub fn step_footprint() -> Footprint {
    Footprint::default().slice::<GatherPoint>(STEP)
}

/// Memory for the points of a step.
///
/// # Errors
/// [`OutOfMemory`] where `arena` has less than [`step_footprint`].
pub fn step_points<'m>(arena: &mut Arena<'m>) -> Result<&'m mut [GatherPoint], OutOfMemory> {
    arena.slice(STEP)
}

/// Places records for one picture.
pub struct RecordPlacement<'p, 'a, F> {
    /// Traces the camera rays and the gather rays.
    pub integrator: &'p PathIntegrator<'a, F>,
    /// Photons of caustics that gather rays merge with. Paths of limited depth must not have any.
    pub photons: Option<CausticMerging<'p>>,
    /// Tables of the strata of records that are seen, and of those behind rough surfaces, of which a pixel
    /// sees the mean.
    pub flux: [&'p CellFlux<'p>; 2],
    /// Error metric, which sets the validity radii.
    pub metric: metric::Settings,
    /// Least radius of a record, in pixels.
    pub least_pixels: f32,
    /// Positions at which records may be placed.
    pub source: PlaceSource<'p>,
    /// [`step_points`].
    pub step: &'p mut [GatherPoint],
    /// Gathering of records with coefficients, if some lobes are served.
    pub lobes: Option<&'p mut LobeGathering<'a>>,
}

/// Gathering of records with coefficients of the incident radiance.
pub struct LobeGathering<'m> {
    lobes: ServedLobes<'m>,
    /// Tables for the number of strata.
    flux: CellFlux<'m>,
    strata: GatherTables<'m>,
    /// Registers of the points between two commits.
    registers: &'m mut [[u16; 16]],
}

impl<'m> LobeGathering<'m> {
    /// Bytes for n × n strata and coefficients of `representation`.
    pub fn footprint(n: usize, representation: Representation) -> Footprint {
        let tables = CellFlux::footprint(n).and(GatherTables::footprint(n, representation));
        tables.slice::<[u16; 16]>(MOST_POINTS * representation.registers())
    }

    /// Gathering for `lobes` with n × n strata.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`LobeGathering::footprint`].
    pub fn new(lobes: ServedLobes<'m>, n: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let of = lobes.representation();
        let (flux, strata) = (CellFlux::build(n, arena)?, GatherTables::build(n, of, arena)?);
        Ok(Self { lobes, flux, strata, registers: arena.slice(MOST_POINTS * of.registers())? })
    }

    /// Lobes that records serve.
    pub fn lobes(&self) -> &ServedLobes<'m> {
        &self.lobes
    }

    /// Gather rays of a record with coefficients.
    pub fn rays(&self) -> usize {
        self.strata.n() * self.strata.n()
    }
}

impl<F: Features> RecordPlacement<'_, '_, F> {
    /// Fills the cache of `builder`, or goes on with it. Incomplete where the executor ends it early.
    ///
    /// # Errors
    /// [`OutOfMemory`] where scratch has less than [`PathIntegrator::gather_scratch_with`].
    pub fn fill(
        &mut self,
        builder: &mut CacheBuilder,
        executor: &mut impl Executor,
    ) -> Result<Passed, OutOfMemory> {
        let mut counters = Counters::default();
        let length = self.source.len();
        let least_pixels = self.least_pixels;
        // With a limit of depth only points that are seen ask for records.
        let has_rough =
            self.source.has_views() && self.integrator.has_rough_surfaces() && !self.integrator.is_limited();
        while let Some(target) = builder.target()
            && !builder.is_finished()
        {
            if builder.next >= length {
                builder.end_sweep(has_rough);
                continue;
            }
            let is_missing = |point: &GatherPoint| !builder.is_served(point, least_pixels);
            let Some(mut end) =
                self.missing_points(builder.next, target, &is_missing, executor, &mut counters)?
            else {
                return Ok(Passed { counters, is_complete: false });
            };
            let mut first = 0;
            while first < end {
                let missing = self.step.get_mut(first..end).unwrap_or_default();
                end = first + retain(missing, |point| !builder.is_served(point, least_pixels));
                let next = end.min(first + POINTS_PER_COMMIT.of(builder.cache.records().len()));
                if !self.gather(first..next, builder, executor, &mut counters)? {
                    return Ok(Passed { counters, is_complete: false });
                }
                first = next;
            }
            builder.next += STEP as u64;
        }
        Ok(Passed { counters, is_complete: true })
    }

    /// Makes all records wider, by the same factor, so that they serve nearly all of what the camera sees
    /// that records of [`WIDEST`] times the width could serve. A cache that had no time is coarse everywhere
    /// rather than good in places.
    ///
    /// # Errors
    /// Those of [`Executor::pass`].
    pub fn widen(
        &mut self,
        builder: &mut CacheBuilder,
        executor: &mut impl Executor,
    ) -> Result<Passed, OutOfMemory> {
        let mut counters = Counters::default();
        let factor = self.widening(builder, executor, &mut counters)?;
        if factor <= 1.0 {
            return Ok(Passed { counters, is_complete: true });
        }
        let integrator = self.integrator;
        let records = builder.cache.records_mut().iter_mut().zip(&*builder.points);
        let passed = executor.pass(records, |_, (record, point), _| {
            let mut counters = Counters::default();
            if point.is_some() {
                *record = integrator.widened(record, point, factor, &mut counters);
            }
            Ok(counters)
        })?;
        builder.cache.widen_coefficients(factor);
        builder.cache.rebuild();
        counters += passed.counters;
        Ok(Passed { counters, ..passed })
    }

    /// The factor of [`RecordPlacement::widen`], by the last step of the order; 1 where the executor ends it
    /// early.
    fn widening(
        &mut self,
        builder: &CacheBuilder,
        executor: &mut impl Executor,
        counters: &mut Counters,
    ) -> Result<f32, OutOfMemory> {
        let first = self.source.len().saturating_sub(STEP as u64);
        let target = (builder.index, Via::Specular);
        let least_pixels = self.least_pixels;
        let is_open = move |point: &GatherPoint| !point.is_confined(least_pixels);
        let Some(count) = self.missing_points(first, target, &is_open, executor, counters)? else {
            return Ok(1.0);
        };
        let points = self.step.get(..count).unwrap_or_default();
        let mut factors = [f32::INFINITY; STEP];
        let tasks = points.chunks(PIXELS).zip(factors.chunks_mut(PIXELS));
        let passed = executor.pass(tasks, |_, (points, factors), _| {
            for (point, factor) in points.iter().zip(factors) {
                *factor = builder.cache.widening(&point.query(), WIDEST).unwrap_or(f32::INFINITY);
            }
            Ok(Counters::default())
        })?;
        let reached = retain(&mut factors, |factor| factor.is_finite());
        let factors = factors.get_mut(..reached).unwrap_or_default();
        factors.sort_unstable_by(f32::total_cmp);
        let nearly_all = factors.get((NEARLY_ALL * reached as f64) as usize);
        Ok(nearly_all.copied().filter(|_| passed.is_complete).unwrap_or(1.0))
    }

    /// Finds the points of the step that begins with pixel `first` of the order, as far as they are wanted,
    /// and returns their number; `None` where the executor ends it early.
    fn missing_points(
        &mut self,
        first: u64,
        target: (u32, Via),
        is_wanted: &(dyn Fn(&GatherPoint) -> bool + Sync),
        executor: &mut impl Executor,
        counters: &mut Counters,
    ) -> Result<Option<usize>, OutOfMemory> {
        let (source, integrator) = (self.source.order(), self.integrator);
        let lobes = self.lobes.as_ref().map(|gathering| gathering.lobes);
        let leave_out = |points: &mut [GatherPoint]| {
            points.iter_mut().filter(|point| !is_wanted(point)).for_each(|point| *point = GatherPoint::NONE);
        };
        let passed = executor.pass(self.step.chunks_mut(PIXELS), |task, points, _| {
            let mut counters = Counters::default();
            let first = first + (task * PIXELS) as u64;
            source.places(integrator, (first, target), lobes.as_ref(), points, &mut counters);
            leave_out(points);
            integrator.measure_overhangs(points, &mut counters);
            leave_out(points);
            Ok(counters)
        })?;
        *counters += passed.counters;
        Ok(passed.is_complete.then(|| retain(self.step, GatherPoint::is_some)))
    }

    /// Gathers at these points of the step, at most [`MOST_POINTS`], and commits the records in their order.
    /// Returns whether that is done.
    fn gather(
        &mut self,
        points: core::ops::Range<usize>,
        builder: &mut CacheBuilder,
        executor: &mut impl Executor,
        counters: &mut Counters,
    ) -> Result<bool, OutOfMemory> {
        let points = self.step.get(points).unwrap_or_default();
        let [flux, behind_rough] = self.flux;
        let flux = if builder.via == Some(Via::Glossy) { behind_rough } else { flux };
        let gathering = Gathering { flux, metric: self.metric, least_pixels: self.least_pixels };
        // Gather rays end in the records that there are.
        let integrator = self.integrator.with_growing_cache(&builder.cache);
        let number = |point: usize| 2 * (builder.gathered + point as u32) + builder.index;
        let mut found = [None; MOST_POINTS];
        let (lobes, registers) = match self.lobes.as_deref_mut() {
            Some(LobeGathering { lobes, flux, strata, registers }) => {
                (Some((&*lobes, &*flux, &*strata)), &mut **registers)
            }
            None => (None, Default::default()),
        };
        let stride = lobes.map_or(1, |(.., strata)| strata.representation().registers());
        let mut staged = registers.chunks_mut(stride);
        let pieces = points.iter().zip(&mut found).map(|piece| (piece, staged.next().unwrap_or_default()));
        let passed = executor.pass(pieces, |i, ((point, found), registers), worker| {
            let mut counters = Counters::default();
            let scratch = &mut worker.scratch;
            let (gathering, strata) = match lobes.filter(|_| point.has_lobe()) {
                Some((lobes, flux, tables)) => {
                    (Gathering { flux, ..gathering }, Some(CoefficientGathering { tables, lobes, registers }))
                }
                None => (gathering, None),
            };
            let record = match self.photons {
                Some(photons) => {
                    let integrator = integrator.with_caustics(photons);
                    integrator.gather_with(point, number(i), &gathering, strata, scratch, &mut counters)?
                }
                None => {
                    integrator.gather_with(point, number(i), &gathering, strata, scratch, &mut counters)?
                }
            };
            let effort = counters.rays as f32 / counters.paths.max(1) as f32;
            *found = record.map(|record| (record, effort));
            Ok(counters)
        })?;
        *counters += passed.counters;
        if passed.is_complete {
            builder.gathered += points.len() as u32;
            let registers = self.lobes.as_ref().map_or(&[][..], |gathering| &*gathering.registers);
            let mut staged = registers.chunks(stride);
            for (found, point) in found.into_iter().zip(points) {
                let registers = staged.next().unwrap_or_default();
                if let Some((record, effort)) = found {
                    builder.insert(record, registers, effort, *point);
                }
            }
        }
        Ok(passed.is_complete)
    }
}

/// Moves the values that are to be kept to the front, in their order, and returns their number.
pub(super) fn retain<T: Copy>(values: &mut [T], is_kept: impl Fn(&T) -> bool) -> usize {
    let mut kept = 0;
    for i in 0..values.len() {
        if is_kept(&values[i]) {
            values[kept] = values[i];
            kept += 1;
        }
    }
    kept
}
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_are_kept_keep_their_order() {
        let mut values = [5, 2, 8, 3, 4, 7];
        let kept = retain(&mut values, |value| value % 2 == 0);
        assert_eq!(values[..kept], [2, 8, 4]);
    }
}
