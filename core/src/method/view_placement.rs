//! Placement of view-bound records, after both irradiance caches are filled, in the order of pixels in which
//! these were ([`super::record_placement`]).

use super::RenderContext;
use super::executor::{Executor, Passed};
use super::record_placement::builder::{SWEEPS_MAX, adds_few};
use super::record_placement::{POINTS_PER_COMMIT, retain};
use crate::bsdf::Features;
use crate::cache::irradiance::{IrradianceCache, QueryPoint, metric};
use crate::cache::view::ViewRecords;
use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, MemorySource, OutOfMemory};
use crate::transport::cached::placement::{PIXELS, ProgressiveOrder};
use crate::transport::cached::view::{SIDE, ViewGathering, ViewPoint, may_serve};
use crate::transport::{CausticMerging, Counters, PathIntegrator};

/// Pixels along the side of the square of which one pixel is looked at.
const STRIDE: u32 = 2;

/// Pixels of a step: those of eight tasks of [`PIXELS`].
const STEP: usize = 8 * PIXELS;

/// Least radius of a record in pixels. Radii of two pixels, as those of irradiance, would flatten the image
/// of a small bright surface.
const LEAST_PIXELS: f32 = 0.5;

/// Gather rays of a record.
pub const RAYS: usize = SIDE * SIDE;

/// Pixels for each record, and the fewest records.
const PIXELS_PER_RECORD: usize = 16;
const FEWEST_RECORDS: usize = 1024;

/// View-bound records of the even and of the odd samples, and the points of a step of their placement.
pub(super) struct Views<'a> {
    pub(super) builders: [ViewBuilder<'a>; 2],
    pub(super) step: &'a mut [ViewPoint],
    /// True if there was no time for all records.
    pub(super) is_cut: bool,
}

impl<'a> Views<'a> {
    /// Memory for a picture of so many pixels.
    pub(super) fn usual_footprint(pixels: usize) -> Footprint {
        Self::footprint((pixels / PIXELS_PER_RECORD).max(FEWEST_RECORDS))
    }

    fn footprint(capacity: usize) -> Footprint {
        let builder = ViewBuilder::footprint(capacity);
        builder.and(builder).and(step_footprint())
    }

    /// Records for the narrow lobes of `context`, if it has any and there is memory beside `reserve` bytes.
    pub(super) fn new(
        context: &RenderContext<'a>,
        reserve: usize,
        memory: &mut impl MemorySource<'a>,
    ) -> Result<Option<Self>, OutOfMemory> {
        let capacity = (context.pixels() / PIXELS_PER_RECORD).max(FEWEST_RECORDS);
        let footprint = Self::usual_footprint(context.pixels());
        let needed = footprint.bytes().saturating_add(reserve);
        if !may_serve(context.scene) || memory.available() < needed {
            return Ok(None);
        }
        let mut arena = memory.take("view-bound records", footprint)?;
        let bounds = context.bvh.bounds();
        let mut builder = |index| ViewBuilder::new(&bounds, capacity, index, &mut arena);
        let builders = [builder(0)?, builder(1)?];
        Ok(Some(Self { builders, step: step_points(&mut arena)?, is_cut: false }))
    }
}

/// View-bound records under construction.
pub struct ViewBuilder<'m> {
    /// Its records so far.
    pub records: ViewRecords<'m>,
    /// Number of the cache among independent ones, whose pixel samples and gather rays differ.
    index: u32,
    /// Next step of the order.
    next: u32,
    sweeps: u32,
    /// Records before the current sweep.
    before: usize,
    gathered: u32,
    is_finished: bool,
}

impl<'m> ViewBuilder<'m> {
    /// Footprint of `capacity` records.
    pub fn footprint(capacity: usize) -> Footprint {
        ViewRecords::footprint(capacity)
    }

    /// Records number 0 or 1 of a scene within `bounds`, none yet, with memory for `capacity` of them.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `arena` has less than [`ViewBuilder::footprint`].
    pub fn new(
        bounds: &Bounds,
        capacity: usize,
        index: u32,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let records = ViewRecords::new(bounds, capacity, arena)?;
        Ok(Self { records, index, next: 0, sweeps: 0, before: 0, gathered: 0, is_finished: false })
    }

    /// Leaves the records as they are.
    pub fn finish(&mut self) {
        self.is_finished = true;
    }

    /// True if no record will be added.
    pub fn is_finished(&self) -> bool {
        self.is_finished
    }

    /// True if nothing is to be gathered at `place`.
    fn is_served(&self, ViewPoint { point, kind, .. }: &ViewPoint) -> bool {
        self.records.is_full()
            || self.records.covers(&QueryPoint::open(point.position(), point.normal()), kind)
    }

    /// Ends a sweep; neighbours have clamped some records, so that others follow.
    fn end_sweep(&mut self) {
        let records = self.records.records().len();
        (self.next, self.sweeps) = (0, self.sweeps + 1);
        self.is_finished =
            adds_few(self.before, records) || self.sweeps == SWEEPS_MAX || self.records.is_full();
        self.before = records;
    }
}

/// Bytes of [`step_points`].
pub fn step_footprint() -> Footprint {
    Footprint::default().slice::<ViewPoint>(STEP)
}

/// Memory for the points of a step.
///
/// # Errors
/// [`OutOfMemory`] if `arena` has less than [`step_footprint`].
pub fn step_points<'m>(arena: &mut Arena<'m>) -> Result<&'m mut [ViewPoint], OutOfMemory> {
    arena.slice(STEP)
}

/// Places view-bound records for one picture.
pub struct ViewPlacement<'p, 'a, F> {
    /// Traces the camera rays and the gather rays.
    pub integrator: &'p PathIntegrator<'a, F>,
    /// Filled irradiance cache of the same samples, in which gather rays end.
    pub irradiance: &'p IrradianceCache<'p>,
    /// Photons of caustics that gather rays merge with.
    pub photons: Option<CausticMerging<'p>>,
    /// Error metric.
    pub metric: metric::Settings,
    /// Width and height of the picture.
    pub size: [u32; 2],
    /// [`step_points`].
    pub step: &'p mut [ViewPoint],
}

impl<F: Features> ViewPlacement<'_, '_, F> {
    /// Fills the records of `builder`, or goes on with it. Incomplete if the executor ends it early.
    ///
    /// # Errors
    /// [`OutOfMemory`] if scratch has less than [`PathIntegrator::view_scratch`].
    pub fn fill(
        &mut self,
        builder: &mut ViewBuilder,
        executor: &mut impl Executor,
    ) -> Result<Passed, OutOfMemory> {
        let mut counters = Counters::default();
        let order = ProgressiveOrder::new(self.size[0], self.size[1], STRIDE);
        while !builder.is_finished() {
            if u64::from(builder.next) >= order.len() {
                builder.end_sweep();
                continue;
            }
            let Some(mut end) = self.missing_points(&order, builder, executor, &mut counters)? else {
                return Ok(Passed { counters, is_complete: false });
            };
            let mut first = 0;
            while first < end {
                let missing = self.step.get_mut(first..end).unwrap_or_default();
                end = first + retain(missing, |place| !builder.is_served(place));
                let most = POINTS_PER_COMMIT.of(builder.records.records().len());
                let next = end.min(first + most);
                if !self.gather((&order, first..next), builder, executor, &mut counters)? {
                    return Ok(Passed { counters, is_complete: false });
                }
                first = next;
            }
            builder.next += STEP as u32;
        }
        Ok(Passed { counters, is_complete: true })
    }

    /// Finds the points of the next step that no record covers, and returns their number; `None` if the
    /// executor ends it early.
    fn missing_points(
        &mut self,
        order: &ProgressiveOrder,
        builder: &ViewBuilder,
        executor: &mut impl Executor,
        counters: &mut Counters,
    ) -> Result<Option<usize>, OutOfMemory> {
        let integrator = self.integrator;
        let lobes = self.irradiance.coefficients().map(|coefficients| *coefficients.lobes());
        let passed = executor.pass(self.step.chunks_mut(PIXELS), |task, places, _| {
            let mut counters = Counters::default();
            let first = builder.next + (task * PIXELS) as u32;
            integrator.view_points((order, builder.index), first, lobes.as_ref(), places, &mut counters);
            for place in places.iter_mut().filter(|place| place.point.is_some() && builder.is_served(place)) {
                *place = ViewPoint::NONE;
            }
            Ok(counters)
        })?;
        *counters += passed.counters;
        Ok(passed.is_complete.then(|| retain(self.step, |place| place.point.is_some())))
    }

    /// Gathers at these points of the step and commits the records in their order. Returns whether that is
    /// done.
    fn gather(
        &mut self,
        (order, points): (&ProgressiveOrder, core::ops::Range<usize>),
        builder: &mut ViewBuilder,
        executor: &mut impl Executor,
        counters: &mut Counters,
    ) -> Result<bool, OutOfMemory> {
        let points = self.step.get(points).unwrap_or_default();
        let gathering = ViewGathering {
            order: (*order, builder.index),
            metric: self.metric,
            least_pixels: LEAST_PIXELS,
            irradiance: self.irradiance,
        };
        let integrator = self.integrator.with_caches([self.irradiance; 2]);
        let number = |point: usize| 2 * (builder.gathered + point as u32) + builder.index;
        let mut found = [None; POINTS_PER_COMMIT.most];
        let photons = self.photons;
        let passed = executor.pass(points.iter().zip(&mut found), |i, (place, found), worker| {
            let mut counters = Counters::default();
            let (number, scratch) = (number(i), &mut worker.scratch);
            *found = match photons {
                Some(photons) => {
                    let integrator = integrator.with_caustics(photons);
                    integrator.gather_view(place, number, &gathering, scratch, &mut counters)?
                }
                None => integrator.gather_view(place, number, &gathering, scratch, &mut counters)?,
            };
            Ok(counters)
        })?;
        *counters += passed.counters;
        if passed.is_complete {
            builder.gathered += points.len() as u32;
            for (found, place) in found.into_iter().zip(points) {
                if let Some(record) = found {
                    builder.records.insert(record, place.kind);
                }
            }
        }
        Ok(passed.is_complete)
    }
}
