//! The overture of an irradiance cache on all threads: it looks over the picture from coarse to fine, gathers where no
//! record reaches, and commits what was found in its order.

use crate::drive::RenderError;
use crate::drive::crew::Crew;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{IrradianceCache, Record};
use halflight_core::memory::{Arena, Line};
use halflight_core::transport::gather::{Gathering, Place};
use halflight_core::transport::overture::{Order, PIXELS};
use halflight_core::transport::{Counters, PathTracer};

/// It looks at every other pixel of every other row: what lies between is reached from there, or path traced.
const STRIDE: u32 = 2;

/// Pixels that are looked at before it is gathered where records are missing: tasks of [`PIXELS`].
const LOOKED_AT: usize = 16 * PIXELS;

/// Records shrink when later ones clamp them or know better, so the overture looks again: so many times, or until a sweep
/// adds less than one record in so many.
const SWEEPS: u32 = 4;
const FEW: usize = 50;

/// Places that are gathered at before their records are committed.
const GATHERED: usize = 32;

/// A cache that is being filled.
pub(in crate::drive) struct Growing<'a> {
    pub(in crate::drive) cache: IrradianceCache<'a>,
    /// Which of independent ones: it looks at another sample of each pixel, and gathers with other rays.
    index: u32,
    /// How far the overture is in its order.
    next: u64,
    /// Sweeps that are done, and how many records there were before this one.
    sweeps: u32,
    before: usize,
    /// Places at which it has gathered.
    gathered: u32,
}

impl<'a> Growing<'a> {
    /// Number 0 or 1.
    pub(in crate::drive) fn new(cache: IrradianceCache<'a>, index: u32) -> Self {
        Self { cache, index, next: 0, sweeps: 0, before: 0, gathered: 0 }
    }

    /// Takes over the records of a file, which were gathered at so many places.
    pub(in crate::drive) fn restore(&mut self, records: &[Record], gathered: u32) {
        self.cache.restore(records);
        self.gathered = gathered;
    }

    /// Places at which it has gathered.
    pub(in crate::drive) fn gathered(&self) -> u32 {
        self.gathered
    }

    /// Leaves the cache as it is.
    pub(in crate::drive) fn finish(&mut self) {
        self.sweeps = SWEEPS;
    }

    /// Whether nothing is to be gathered at `place`.
    fn is_served(&self, place: &Place) -> bool {
        self.cache.is_full() || self.cache.covers(place.position(), place.normal())
    }
}

/// See the file.
pub(in crate::drive) struct Overture<'o, 'a, F> {
    pub(in crate::drive) tracer: &'o PathTracer<'a, F>,
    pub(in crate::drive) gathering: &'o Gathering<'o>,
    pub(in crate::drive) size: [u32; 2],
}

impl<F: Features> Overture<'_, '_, F> {
    /// Whether there is nothing left to fill.
    pub(in crate::drive) fn is_done(&self, growing: &Growing) -> bool {
        let [width, height] = self.size;
        growing.next >= Order::new(width, height, STRIDE).len() || growing.cache.is_full()
    }

    /// Fills the cache, or goes on with it. Whether it is done: not where the round is over.
    pub(in crate::drive) fn fill(
        &self,
        growing: &mut Growing,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<bool, RenderError> {
        let [width, height] = self.size;
        let order = Order::new(width, height, STRIDE);
        while growing.sweeps < SWEEPS && !growing.cache.is_full() {
            if growing.next >= order.len() {
                growing.next = 0;
                growing.sweeps += 1;
                let records = growing.cache.records().len();
                if (records - growing.before) * FEW < records {
                    growing.sweeps = SWEEPS;
                }
                growing.before = records;
                continue;
            }
            let mut places = vec![Place::NONE; LOOKED_AT];
            let look = |task: usize, _: &mut Arena, out: &mut [Place]| {
                let mut counters = Counters::default();
                let first = growing.next + (task * PIXELS) as u64;
                self.tracer.places(&order, first, growing.index, out, &mut counters);
                out.iter_mut()
                    .filter(|place| growing.is_served(place))
                    .for_each(|place| *place = Place::NONE);
                Ok(counters)
            };
            if !crew.pass(&mut places, PIXELS, scratch, &look)? {
                return Ok(false);
            }
            let mut missing: Vec<Place> = places.into_iter().filter(Place::is_some).collect();
            while !missing.is_empty() {
                missing.retain(|place| !growing.is_served(place));
                let batch: Vec<Place> = missing.drain(..missing.len().min(GATHERED)).collect();
                if !self.gather(&batch, growing, crew, scratch)? {
                    return Ok(false);
                }
            }
            growing.next += LOOKED_AT as u64;
        }
        Ok(true)
    }

    /// Gathers at all of `places`, then commits the records in their order. Whether it was done.
    fn gather(
        &self,
        places: &[Place],
        growing: &mut Growing,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<bool, RenderError> {
        let mut records: Vec<Option<Record>> = vec![None; places.len()];
        // What a gather ray meets may be lit by the cache already.
        let tracer = self.tracer.with_growing_cache(&growing.cache);
        let first = growing.gathered;
        let task = |task: usize, arena: &mut Arena, out: &mut [Option<Record>]| {
            let mut counters = Counters::default();
            let number = 2 * (first + task as u32) + growing.index;
            if let (Some(out), Some(place)) = (out.first_mut(), places.get(task)) {
                *out = tracer.gather(place, number, self.gathering, arena, &mut counters)?;
            }
            Ok(counters)
        };
        if !crew.pass(&mut records, 1, scratch, &task)? {
            return Ok(false);
        }
        growing.gathered += places.len() as u32;
        records.into_iter().flatten().for_each(|record| _ = growing.cache.insert(record));
        Ok(true)
    }
}
