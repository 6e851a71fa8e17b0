//! Coefficients beside the records of an irradiance cache: those of surfaces with served lobes have some.

use super::basis::Representation;
use super::pool::{CoefficientPool, PooledRecord};
use super::served::ServedLobes;
use crate::memory::{Arena, Footprint, OutOfMemory};

/// Coefficients of the records of a cache, by their numbers.
#[derive(Debug)]
pub struct RecordCoefficients<'m> {
    lobes: ServedLobes<'m>,
    pool: CoefficientPool<'m>,
    of_record: &'m mut [PooledRecord],
}

impl<'m> RecordCoefficients<'m> {
    /// Footprint for `capacity` records of `representation`.
    pub fn footprint(capacity: usize, representation: Representation) -> Footprint {
        CoefficientPool::footprint(capacity, representation).slice::<PooledRecord>(capacity)
    }

    /// Memory for `capacity` records that serve `lobes`.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`RecordCoefficients::footprint`].
    pub fn new(lobes: ServedLobes<'m>, capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let pool = CoefficientPool::new(capacity, lobes.representation(), arena)?;
        Ok(Self { lobes, pool, of_record: arena.slice(capacity)? })
    }

    /// Lobes that the records serve.
    pub fn lobes(&self) -> &ServedLobes<'m> {
        &self.lobes
    }

    /// Pool of the coefficients.
    pub fn pool(&self) -> &CoefficientPool<'m> {
        &self.pool
    }

    /// Coefficients of record `number`, if it has any.
    #[inline]
    pub fn of(&self, number: u32) -> Option<&PooledRecord> {
        self.of_record.get(number as usize).filter(|record| record.is_some())
    }

    /// Coefficients of the first `count` records; entries of records without any are zero.
    pub fn records(&self, count: usize) -> &[PooledRecord] {
        self.of_record.get(..count).unwrap_or_default()
    }

    /// Sets the coefficients of record `number` from `registers`, or none.
    pub(crate) fn set(&mut self, number: usize, found: Option<(&PooledRecord, &[[u16; 16]])>) {
        if let Some(slot) = self.of_record.get_mut(number) {
            let found = found.and_then(|(record, registers)| self.pool.append(record, registers));
            *slot = found.unwrap_or_default();
        }
    }

    /// Keeps those of the first `count` records for which `is_kept` holds, in order.
    pub(crate) fn retain(&mut self, count: usize, is_kept: impl Fn(usize) -> bool) {
        let Self { pool, of_record, .. } = self;
        pool.clear();
        for (kept, number) in (0..count).filter(|&number| is_kept(number)).enumerate() {
            let record = of_record.get(number).copied().filter(PooledRecord::is_some);
            let record = record.and_then(|record| pool.keep(&record));
            if let Some(slot) = of_record.get_mut(kept) {
                *slot = record.unwrap_or_default();
            }
        }
    }

    /// Scales gradients by 1/`factor`, as those of widened records.
    pub(crate) fn widen(&mut self, factor: f32) {
        self.of_record.iter_mut().for_each(|record| record.unit *= factor);
    }

    /// Replaces the content by that of another cache.
    pub fn restore(&mut self, records: &[PooledRecord], registers: &[[u16; 16]]) {
        self.pool.clear();
        for (number, record) in records.iter().enumerate() {
            self.set(number, record.is_some().then_some((record, registers)));
        }
    }
}
