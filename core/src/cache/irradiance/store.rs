//! Irradiance cache: records, an octree over their supports, and interpolation.

use super::lanes::QueryPoint;
use super::neighbours::Neighbours;
use super::record::Record;
use crate::Rgb;
use crate::cache::octree::Octree;
use crate::cache::radiance::{PooledRecord, RecordCoefficients};
use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, OutOfMemory};
use glam::Vec3;

/// Maximum angle in radians between the normals of a point and a valid record: light beyond the turned
/// horizon was not sampled (Schwarzhaupt et al. 2012, §4.3).
pub const GREATEST_DEVIATION: f32 = 0.2;

/// Interpolated values of a cache at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CachedIrradiance {
    /// Irradiance without direct light of emitters, in W/m².
    pub irradiance: Rgb,
    /// M₅ = ∫ L (1 - cos)⁵ cos dω of the same light, in W/m².
    pub edge_moment: Rgb,
    /// Cosine-weighted fraction of the hemisphere that sees emitters or the environment directly.
    pub shining: f32,
}

/// Records in the caller's memory. Frozen during rendering; grows by [`IrradianceCache::insert`].
#[derive(Debug)]
pub struct IrradianceCache<'m> {
    records: &'m mut [Record],
    used: usize,
    tree: Octree<'m>,
    least_cos: f32,
    /// Number of records rejected for lack of memory.
    refused: u64,
    /// Coefficients of radiance beside the records of surfaces with served lobes.
    coefficients: Option<RecordCoefficients<'m>>,
}

impl<'m> IrradianceCache<'m> {
    /// Footprint of `capacity` records.
    pub fn footprint(capacity: usize) -> Footprint {
        Footprint::default().slice::<Record>(capacity).and(Octree::footprint(capacity))
    }

    /// Number of records that fit into `bytes`.
    pub fn capacity_of(bytes: usize) -> usize {
        let each = Self::footprint(1 << 20).bytes() >> 20;
        let mut capacity = bytes / each.max(1);
        while capacity > 0 && Self::footprint(capacity).bytes() > bytes {
            capacity -= 1 + capacity / 64;
        }
        capacity
    }

    /// Empty cache of a scene within `bounds`, with memory for `capacity` records.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`IrradianceCache::footprint`].
    pub fn new(bounds: &Bounds, capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let records = arena.slice(capacity)?;
        let tree = Octree::new(bounds, capacity, arena)?;
        let least_cos = libm::cosf(GREATEST_DEVIATION);
        Ok(Self { records, used: 0, tree, least_cos, refused: 0, coefficients: None })
    }

    /// This cache, still empty, with coefficients beside its records.
    pub fn with_coefficients(self, coefficients: Option<RecordCoefficients<'m>>) -> Self {
        Self { coefficients, ..self }
    }

    /// Coefficients beside the records, if some surfaces of the scene need them.
    #[inline]
    pub fn coefficients(&self) -> Option<&RecordCoefficients<'m>> {
        self.coefficients.as_ref()
    }

    /// Records in order of insertion.
    pub fn records(&self) -> &[Record] {
        self.records.get(..self.used).unwrap_or_default()
    }

    /// Maximum number of records.
    pub fn capacity(&self) -> usize {
        self.records.len()
    }

    /// True if there is no memory for another record.
    pub fn is_full(&self) -> bool {
        self.used == self.records.len()
    }

    /// Number of records rejected because the cache was full.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Interpolated irradiance at `point`; `None` without a valid record.
    ///
    /// E = Σ w_i (E_i + ∇E_i · Δx_i + ∇_n E_i · (n_i × n)) / Σ w_i (Schwarzhaupt et al. 2012, equation 12),
    /// with the second order where a metric has it.
    #[inline]
    pub fn at(&self, point: &QueryPoint) -> Option<CachedIrradiance> {
        let (mut sum, mut edge, mut shining, mut weights) = (Rgb::ZERO, Rgb::ZERO, 0.0, 0.0);
        self.tree.at(point.position, |index| {
            if let Some(record) = self.records.get(index as usize)
                && let Some((irradiance, weight)) = record.at(point, self.least_cos)
            {
                sum += weight * irradiance;
                edge += weight * (irradiance * Rgb::from(record.edge_fraction));
                shining += weight * record.shining;
                weights += weight;
            }
            true
        });
        (weights > 0.0).then(|| CachedIrradiance {
            irradiance: sum / weights,
            edge_moment: edge / weights,
            shining: shining / weights,
        })
    }

    /// Irradiance from the first valid record, without interpolation, and the distance of that record as in
    /// [`IrradianceCache::at_all`]. Good enough for gather rays, whose values are averaged.
    #[inline]
    pub fn first_valid(&self, point: &QueryPoint) -> Option<(CachedIrradiance, f32)> {
        let mut found = None;
        self.tree.at(point.position, |index| {
            if let Some(record) = self.records.get(index as usize)
                && let Some((irradiance, _)) = record.at(point, self.least_cos)
            {
                let exposed = record.exposed(point);
                let edge_moment = irradiance * Rgb::from(record.edge_fraction);
                let cached = CachedIrradiance { irradiance, edge_moment, shining: record.shining };
                found = Some((cached, exposed));
            }
            found.is_none()
        });
        found
    }

    /// Octree, records, and cosine of the maximum angle between normals.
    #[inline]
    pub(super) fn parts(&self) -> (&Octree<'m>, &[Record], f32) {
        (&self.tree, self.records(), self.least_cos)
    }

    /// Calls `visit` with each record that is valid at a point, and its weight.
    pub fn visit(&self, point: &QueryPoint, mut visit: impl FnMut(&Record, f32)) {
        self.tree.at(point.position, |index| {
            if let Some(record) = self.records.get(index as usize)
                && let Some((_, weight)) = record.at(point, self.least_cos)
            {
                visit(record, weight);
            }
            true
        });
    }

    /// Calls `visit` with each record with coefficients that is valid at a point, and its weight, while it
    /// returns true. Supports are at most `support` radii.
    pub(super) fn visit_lobes(
        &self,
        point: &QueryPoint,
        support: f32,
        mut visit: impl FnMut((&Record, &PooledRecord), f32) -> bool,
    ) {
        self.tree.at(point.position, |index| {
            let pooled = self.coefficients.as_ref().and_then(|known| known.of(index));
            match self.records.get(index as usize).zip(pooled) {
                Some(found) => match found.0.weight(point, self.least_cos, support) {
                    Some(weight) => visit(found, weight),
                    None => true,
                },
                None => true,
            }
        });
    }

    /// Calls `visit` with the irradiance that each valid record extrapolates to a point, and its weight.
    pub fn visit_values(&self, point: &QueryPoint, mut visit: impl FnMut(Rgb, f32)) {
        self.tree.at(point.position, |index| {
            if let Some(record) = self.records.get(index as usize)
                && let Some((irradiance, weight)) = record.at(point, self.least_cos)
            {
                visit(irradiance, weight);
            }
            true
        });
    }

    /// Calls `visit` with each record that is valid at a point, its number, the value that it extrapolates
    /// and its weight.
    pub(in crate::cache) fn visit_extrapolated(
        &self,
        point: &QueryPoint,
        mut visit: impl FnMut(u32, &Record, (Rgb, f32)),
    ) {
        self.tree.at(point.position, |index| {
            if let Some(record) = self.records.get(index as usize)
                && let Some(extrapolated) = record.at(point, self.least_cos)
            {
                visit(index, record, extrapolated);
            }
            true
        });
    }

    /// True if a record covers the point for which `is_asked` holds, whatever hangs over the point.
    pub(in crate::cache) fn covers_by(
        &self,
        point: &QueryPoint,
        is_asked: impl Fn(u32, &Record) -> bool,
    ) -> bool {
        let mut covered = false;
        self.tree.at(point.position, |index| {
            let record = self.records.get(index as usize).filter(|record| is_asked(index, record));
            covered = record.is_some_and(|record| record.covers(point, self.least_cos));
            !covered
        });
        covered
    }

    /// True if a record covers the point. If the height of overhangs above the point is unknown (`within` is
    /// infinite), the record must be valid for any height.
    #[inline]
    pub fn covers(&self, point: &QueryPoint) -> bool {
        self.is_covered(point, |_| true)
    }

    /// True if a record with coefficients covers the point.
    pub fn covers_lobe(&self, point: &QueryPoint) -> bool {
        self.is_covered(point, |index| {
            self.coefficients.as_ref().is_some_and(|found| found.of(index).is_some())
        })
    }

    /// True if a record covers the point for which `is_asked` holds.
    #[inline]
    fn is_covered(&self, point: &QueryPoint, is_asked: impl Fn(u32) -> bool) -> bool {
        let mut covered = false;
        self.tree.at(point.position, |index| {
            let record = self.records.get(index as usize).filter(|_| is_asked(index));
            let is_certain = |record: &Record| point.within < f32::INFINITY || record.exposed(point) == 0.0;
            covered = record.is_some_and(|record| record.covers(point, self.least_cos) && is_certain(record));
            !covered
        });
        covered
    }

    /// Inserts a record, after it and its neighbours have been compared and clamped. Returns whether there
    /// was memory.
    pub fn insert(&mut self, record: Record) -> bool {
        self.insert_with(record, None)
    }

    /// [`IrradianceCache::insert`] with coefficients in `registers` of their own.
    pub fn insert_with(
        &mut self,
        record: Record,
        coefficients: Option<(&PooledRecord, &[[u16; 16]])>,
    ) -> bool {
        self.insert_among(record, coefficients, |_, _| true)
    }

    /// [`IrradianceCache::insert_with`] for a record whose neighbours are only those for which
    /// `is_alike` holds, by number.
    pub(in crate::cache) fn insert_among(
        &mut self,
        mut record: Record,
        coefficients: Option<(&PooledRecord, &[[u16; 16]])>,
        is_alike: impl Fn(u32, &Record) -> bool,
    ) -> bool {
        if self.is_full() {
            self.refused += 1;
            return false;
        }
        let Self { records, tree, least_cos, .. } = self;
        let mut neighbours = Neighbours { records, tree, least_cos: *least_cos, is_alike };
        neighbours.compare(&mut record);
        neighbours.clamp(&mut record);
        if let Some(slot) = self.records.get_mut(self.used) {
            *slot = record;
        }
        if let Some(known) = &mut self.coefficients {
            known.set(self.used, coefficients);
        }
        if self.used.is_power_of_two() {
            self.link(2 * self.used);
        } else if !self.tree.has_room() {
            self.link(self.capacity());
        }
        self.tree.insert(self.used as u32, Vec3::from(record.position), record.extent(), usize::MAX);
        self.used += 1;
        true
    }

    /// Factor by which the nearest record, in radii, has to be widened to cover `point`; `None` above `most`.
    pub fn widening(&self, point: &QueryPoint, most: f32) -> Option<f32> {
        let nearest = |least: Option<f32>, record: &Record| {
            record.widening(point, self.least_cos, least.unwrap_or(most)).or(least)
        };
        self.records().iter().fold(None, nearest)
    }

    /// Records for changes in place, to be followed by [`IrradianceCache::rebuild`] if a record becomes
    /// wider.
    pub fn records_mut(&mut self) -> &mut [Record] {
        self.records.get_mut(..self.used).unwrap_or_default()
    }

    /// Keeps the records for which `is_kept` holds, in order.
    pub fn retain(&mut self, is_kept: impl Fn(usize) -> bool) {
        if let Some(known) = &mut self.coefficients {
            known.retain(self.used, &is_kept);
        }
        let mut kept = 0;
        for index in (0..self.used).filter(|&index| is_kept(index)) {
            self.records.copy_within(index..index + 1, kept);
            kept += 1;
        }
        self.used = kept;
        self.rebuild();
    }

    /// Scales the gradients of coefficients by 1/`factor`, as [`Record::widened`] does.
    pub fn widen_coefficients(&mut self, factor: f32) {
        if let Some(known) = &mut self.coefficients {
            known.widen(factor);
        }
    }

    /// Restores the coefficients of the records of [`IrradianceCache::restore`].
    pub fn restore_coefficients(&mut self, records: &[PooledRecord], registers: &[[u16; 16]]) {
        if let Some(known) = &mut self.coefficients {
            known.restore(records, registers);
        }
    }

    /// Scales all radii by `share`, as for an allowed error scaled by its fourth power. Uncovered areas have
    /// to be filled again.
    pub fn scale_radii(&mut self, share: f32) {
        self.records.iter_mut().take(self.used).for_each(|record| record.scale_radii(share));
        self.rebuild();
    }

    /// Links all records anew by their present supports, so that clamped records are found less often. The
    /// order in which a point finds its records, and with it the last bit of the result, then depends on the
    /// records alone.
    pub fn rebuild(&mut self) {
        self.link(self.used);
    }

    /// Links all records, with links reserved for `expected` records in total.
    fn link(&mut self, expected: usize) {
        let expected = expected.min(self.capacity());
        let Self { records, used, tree, .. } = self;
        tree.clear();
        for (index, record) in (0..).zip(records.iter().take(*used)) {
            let others = expected.saturating_sub(index as usize + 1);
            tree.insert(index, Vec3::from(record.position), record.extent(), others);
        }
    }

    /// Replaces the content by `records` of another cache of the same scene, as they are. Records beyond the
    /// capacity are rejected.
    pub fn restore(&mut self, records: &[Record]) {
        self.used = records.len().min(self.records.len());
        self.refused = (records.len() - self.used) as u64;
        for (slot, record) in self.records.iter_mut().zip(records) {
            *slot = *record;
        }
        self.rebuild();
    }
}

#[cfg(test)]
mod tests;
