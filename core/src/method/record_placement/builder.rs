//! A cache under construction: its records, and the sweeps that add to them.

use crate::cache::irradiance::{IrradianceCache, Record};
use crate::cache::radiance::{PooledRecord, RecordCoefficients, Representation, ServedLobes};
use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::cached::gather::GatherPoint;
use crate::transport::cached::placement::Via;

/// Records shrink when their neighbours clamp them, so sweeps are repeated, at most this many times, or until
/// a sweep adds less than one record in [`FEW`]. Behind rough surfaces each sweep sees other points.
pub(in crate::method) const SWEEPS_MAX: u32 = 4;
const FEW: usize = 50;

/// True if the sweep that began with `before` records and ended with `records` was of little use.
pub(in crate::method) fn adds_few(before: usize, records: usize) -> bool {
    (records - before.min(records)) * FEW < records
}

/// The first gather rays end in no record, so they are long. After the first sweep the records that took more
/// rays than this for each path, over the median, are gathered again.
const LONG: f32 = 1.3;

/// A cache under construction.
pub struct CacheBuilder<'m> {
    /// Its records so far.
    pub cache: IrradianceCache<'m>,
    /// Number of the cache among independent ones, whose pixel samples and gather rays differ.
    pub(super) index: u32,
    /// The points that this sweep looks for; `None` at the end.
    pub(super) via: Option<Via>,
    /// Next step of the order.
    pub(super) next: u64,
    /// Sweeps for these points that are done, and the records before the current sweep.
    sweeps: u32,
    before: usize,
    /// Most records for now.
    most: usize,
    /// Points at which light was gathered.
    pub(super) gathered: u32,
    /// Records that came from elsewhere, which are first in the cache.
    restored: usize,
    /// Rays for each gather path, of each record.
    efforts: &'m mut [f32],
    /// Gather point of each record; [`GatherPoint::NONE`] of those that were restored.
    pub(super) points: &'m mut [GatherPoint],
}

impl<'m> CacheBuilder<'m> {
    /// Bytes for `capacity` records, with coefficients if they have a representation.
    pub fn footprint(capacity: usize, representation: Option<Representation>) -> Footprint {
        let records =
            IrradianceCache::footprint(capacity).slice::<f32>(capacity).slice::<GatherPoint>(capacity);
        match representation {
            Some(representation) => records.and(RecordCoefficients::footprint(capacity, representation)),
            None => records,
        }
    }

    /// Number of records that fit into `bytes`.
    pub fn capacity_of(bytes: usize, representation: Option<Representation>) -> usize {
        let mut capacity = IrradianceCache::capacity_of(bytes);
        while capacity > 0 && Self::footprint(capacity, representation).bytes() > bytes {
            capacity -= 1 + capacity / 64;
        }
        capacity
    }

    /// An empty cache, number 0 or 1, of a scene within `bounds`, with memory for `capacity` records, which
    /// serve `lobes`.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`CacheBuilder::footprint`].
    pub fn new(
        bounds: &Bounds,
        capacity: usize,
        index: u32,
        lobes: Option<ServedLobes<'m>>,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let cache = IrradianceCache::new(bounds, capacity, arena)?;
        let (efforts, points) = (arena.slice(capacity)?, arena.slice(capacity)?);
        let coefficients = lobes.map(|lobes| RecordCoefficients::new(lobes, capacity, arena)).transpose()?;
        Ok(Self {
            cache: cache.with_coefficients(coefficients),
            index,
            via: Some(Via::Specular),
            next: 0,
            sweeps: 0,
            before: 0,
            most: usize::MAX,
            gathered: 0,
            restored: 0,
            efforts,
            points,
        })
    }

    /// Begins with `records`, for which light was gathered at `gathered` points.
    pub fn restore(&mut self, records: &[Record], gathered: u32) {
        self.cache.restore(records);
        self.restored = self.cache.records().len();
        self.points.iter_mut().take(self.restored).for_each(|point| *point = GatherPoint::NONE);
        self.gathered = gathered;
    }

    /// Begins again without records.
    pub fn clear(&mut self) {
        self.cache.retain(|_| false);
        (self.via, self.next, self.sweeps, self.before) = (Some(Via::Specular), 0, 0, 0);
        (self.gathered, self.restored) = (0, 0);
    }

    /// Begins again with the records that there are, their radii times `factor`, at most 1.
    pub fn tighten(&mut self, factor: f32) {
        self.cache.scale_radii(factor);
        self.restored = self.cache.records().len();
        (self.via, self.next, self.sweeps, self.before) = (Some(Via::Specular), 0, 0, self.restored);
    }

    /// Allows so many records.
    pub fn limit(&mut self, most: usize) {
        self.most = most;
    }

    fn is_full(&self) -> bool {
        self.cache.is_full() || self.cache.records().len() >= self.most
    }

    /// Leaves the cache as it is.
    pub fn finish(&mut self) {
        self.via = None;
    }

    /// True if no record will be added.
    pub fn is_finished(&self) -> bool {
        self.via.is_none() || self.is_full()
    }

    /// Points at which light was gathered.
    pub fn gathered(&self) -> u32 {
        self.gathered
    }

    /// The points of the current sweep, and the sample of each pixel that finds them.
    pub(super) fn target(&self) -> Option<(u32, Via)> {
        self.via.map(|via| match via {
            Via::Specular => (self.index, via),
            Via::Glossy => (self.index + 2 * self.sweeps, via),
        })
    }

    /// Ends a sweep: another one follows, or the first for points behind rough surfaces, if the scene has
    /// any.
    pub(super) fn end_sweep(&mut self, has_rough: bool) {
        (self.next, self.sweeps) = (0, self.sweeps + 1);
        let is_first = self.via == Some(Via::Specular) && self.sweeps == 1;
        if is_first {
            self.forget_long();
        }
        let records = self.cache.records().len();
        let adds_few = adds_few(self.before, records);
        self.before = records;
        if !is_first && adds_few || self.sweeps == SWEEPS_MAX {
            let is_next = has_rough && self.via == Some(Via::Specular);
            (self.via, self.sweeps) = (is_next.then_some(Via::Glossy), 0);
        }
    }

    /// Forgets the records whose gather rays were long. Their rays decide and not their light, so that no
    /// light is preferred.
    fn forget_long(&mut self) {
        let Self { cache, restored, efforts, points, .. } = self;
        let count = cache.records().len();
        let median = efforts.get(*restored..count).and_then(median);
        let most = LONG * median.unwrap_or(f32::INFINITY);
        let is_kept = |index: usize| index < *restored || efforts.get(index).is_some_and(|&e| e <= most);
        for (kept, index) in (0..count).filter(|&index| is_kept(index)).enumerate() {
            points.copy_within(index..index + 1, kept);
        }
        cache.retain(is_kept);
    }

    /// True if nothing is to be gathered at `point`, for records of at least `least_pixels` pixels.
    pub(super) fn is_served(&self, point: &GatherPoint, least_pixels: f32) -> bool {
        let covers = |query| match point.has_lobe() {
            true => self.cache.covers_lobe(query),
            false => self.cache.covers(query),
        };
        self.is_full() || point.is_confined(least_pixels) || covers(&point.query())
    }

    /// Commits the record of `point`, with coefficients in `registers` if it has any.
    pub(super) fn insert(
        &mut self,
        (record, coefficients): (Record, PooledRecord),
        registers: &[[u16; 16]],
        effort: f32,
        point: GatherPoint,
    ) {
        let index = self.cache.records().len();
        let coefficients = coefficients.is_some().then_some((&coefficients, registers));
        if self.cache.insert_with(record, coefficients)
            && let Some((of_effort, of_point)) = self.efforts.get_mut(index).zip(self.points.get_mut(index))
        {
            (*of_effort, *of_point) = (effort, point);
        }
    }
}

/// The value in the middle of positive `values`, the upper one of two; `None` of none.
fn median(values: &[f32]) -> Option<f32> {
    let below = |bits: u32| values.iter().filter(|value| value.to_bits() < bits).count();
    // Positive floats are ordered as their bits: the largest number with no more than half of the values
    // below it.
    let largest = (0..31).rev().fold(0, |bits, bit| {
        let more = bits | 1 << bit;
        if below(more) <= values.len() / 2 { more } else { bits }
    });
    (!values.is_empty()).then(|| f32::from_bits(largest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_that_of_a_sort() {
        let mut values = [3.5, 1.0, 2.0, 7.25, 2.0, 0.0, 1e-30, 1e30];
        for count in 1..=values.len() {
            let found = median(&values[..count]);
            let mut sorted = values;
            sorted[..count].sort_by(f32::total_cmp);
            assert_eq!(found, Some(sorted[count / 2]), "{count}");
        }
        values.fill(f32::INFINITY);
        assert_eq!((median(&values), median(&[])), (Some(f32::INFINITY), None));
    }
}
