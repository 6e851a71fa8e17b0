//! Irradiance cache: records, an octree over their supports, and interpolation.

use super::lanes::QueryPoint;
use super::neighbours::Neighbours;
use super::record::Record;
use crate::Rgb;
use crate::cache::octree::Octree;
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
        Ok(Self { records, used: 0, tree, least_cos: libm::cosf(GREATEST_DEVIATION), refused: 0 })
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
        let (mut sum, mut shining, mut weights) = (Rgb::ZERO, 0.0, 0.0);
        self.tree.at(point.position, |index| {
            if let Some(record) = self.records.get(index as usize)
                && let Some((irradiance, weight)) = record.at(point, self.least_cos)
            {
                sum += weight * irradiance;
                shining += weight * record.shining;
                weights += weight;
            }
            true
        });
        (weights > 0.0).then(|| CachedIrradiance { irradiance: sum / weights, shining: shining / weights })
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
                found = Some((CachedIrradiance { irradiance, shining: record.shining }, exposed));
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

    /// True if a record covers the point. If the height of overhangs above the point is unknown (`within` is
    /// infinite), the record must be valid for any height.
    #[inline]
    pub fn covers(&self, point: &QueryPoint) -> bool {
        let mut covered = false;
        self.tree.at(point.position, |index| {
            let record = self.records.get(index as usize);
            let is_heard = |record: &Record| point.within < f32::INFINITY || record.exposed(point) == 0.0;
            covered = record.is_some_and(|record| record.covers(point, self.least_cos) && is_heard(record));
            !covered
        });
        covered
    }

    /// Inserts a record, after it and its neighbours have been compared and clamped. Returns whether there
    /// was memory.
    pub fn insert(&mut self, mut record: Record) -> bool {
        if self.is_full() {
            self.refused += 1;
            return false;
        }
        let Self { records, tree, least_cos, .. } = self;
        let mut neighbours = Neighbours { records, tree, least_cos: *least_cos };
        neighbours.compare(&mut record);
        neighbours.clamp(&mut record);
        if let Some(slot) = self.records.get_mut(self.used) {
            *slot = record;
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
        let mut kept = 0;
        for index in (0..self.used).filter(|&index| is_kept(index)) {
            self.records.copy_within(index..index + 1, kept);
            kept += 1;
        }
        self.used = kept;
        self.rebuild();
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
mod tests {
    use super::*;
    use crate::cache::irradiance::SECTORS;
    use crate::cache::irradiance::validity::radius;
    use crate::memory::Line;
    use crate::sampling::Random;
    use std::vec;

    const BOUNDS: Bounds = Bounds { min: Vec3::ZERO, max: Vec3::ONE };

    fn with_cache<T>(capacity: usize, then: impl FnOnce(&mut IrradianceCache) -> T) -> T {
        let mut lines = vec![Line([0xff; 64]); IrradianceCache::footprint(capacity).bytes() / 64];
        let mut arena = Arena::new(bytemuck::cast_slice_mut(&mut lines));
        then(&mut IrradianceCache::new(&BOUNDS, capacity, &mut arena).unwrap())
    }

    /// Record on the plane z = 1/2, where E = 1 + x in red, 2 in the other channels.
    fn record(x: f32, y: f32, radius: f32) -> Record {
        Record {
            position: [x, y, 0.5],
            normal: [0.0, 0.0, 1.0],
            axis: [1.0, 0.0, 0.0],
            irradiance: [1.0 + x, 2.0, 2.0],
            gradient: [[1.0, 0.0], [0.0; 2], [0.0; 2]],
            radii: [radius, 1.5 * radius],
            overlap: 1.0,
            reach: 1.5 * radius,
            boundary: [u8::MAX; SECTORS],
            free: [u8::MAX; SECTORS],
            ..Record::default()
        }
    }

    #[test]
    fn the_footprint_is_exact_and_a_full_cache_says_so() {
        for capacity in [0, 1, 100] {
            let bytes = IrradianceCache::footprint(capacity).bytes();
            let mut lines = vec![Line([0; 64]); bytes / 64];
            let memory: &mut [u8] = bytemuck::cast_slice_mut(&mut lines);
            let short = bytes.saturating_sub(1);
            let cache = IrradianceCache::new(&BOUNDS, capacity, &mut Arena::new(&mut memory[..short]));
            assert_eq!(cache.is_err(), capacity > 0);
            assert!(IrradianceCache::new(&BOUNDS, capacity, &mut Arena::new(memory)).is_ok());
            assert!(IrradianceCache::footprint(IrradianceCache::capacity_of(bytes)).bytes() <= bytes);
            assert!(IrradianceCache::capacity_of(bytes) <= capacity);
        }
        with_cache(2, |cache| {
            let inserted = [0.1, 0.2, 0.3].map(|x| cache.insert(record(x, 0.5, 0.1)));
            assert_eq!((inserted, cache.is_full(), cache.refused()), ([true, true, false], true, 1));
            assert_eq!(cache.records().len(), 2);
        });
    }

    #[test]
    fn a_plane_of_linear_irradiance_is_what_it_is_everywhere() {
        with_cache(300, |cache| {
            let random = Random::new(1, 1);
            for i in 0..300 {
                let radius = 0.1 + 0.1 * random.single(3 * i);
                assert!(cache.insert(record(random.single(3 * i + 1), random.single(3 * i + 2), radius)));
            }
            for i in 0..1000 {
                let (x, y) = (random.single(10_000 + 2 * i), random.single(10_001 + 2 * i));
                let e = cache.at(&QueryPoint::open(Vec3::new(x, y, 0.5), Vec3::Z)).unwrap().irradiance;
                assert!(e.distance(Vec3::new(1.0 + x, 2.0, 2.0)) < 1e-5, "{x} {y}: {e}");
                assert!(cache.covers(&QueryPoint::open(Vec3::new(x, y, 0.5), Vec3::Z)));
                assert_eq!(cache.at(&QueryPoint::open(Vec3::new(x, y, 0.5), Vec3::NEG_Z)), None);
                assert_eq!(cache.at(&QueryPoint::open(Vec3::new(x, y, 0.9), Vec3::Z)), None);
            }
        });
    }

    #[test]
    fn a_gap_is_covered_once_the_nearest_record_in_radii_is_wide_enough() {
        with_cache(2, |cache| {
            cache.insert(record(0.2, 0.5, 0.05));
            cache.insert(record(0.8, 0.5, 0.1));
            let (gap, turned) = (Vec3::new(0.5, 0.5, 0.5), Vec3::X);
            // 0.3 is 6 radii of the first record and 3 of the second.
            let factor = cache.widening(&QueryPoint::open(gap, Vec3::Z), 6.0).unwrap();
            assert!((3.0..3.01).contains(&factor), "{factor}");
            assert_eq!(cache.widening(&QueryPoint::open(gap, Vec3::Z), 2.9), None);
            assert_eq!(cache.widening(&QueryPoint::open(gap, turned), 6.0), None);
            let covered = QueryPoint::open(Vec3::new(0.75, 0.5, 0.5), Vec3::Z);
            assert_eq!(cache.widening(&covered, 6.0), Some(1.0));
            let wide = |cache: &mut IrradianceCache, factor| {
                cache.records_mut().iter_mut().for_each(|record| *record = record.widened(factor));
                cache.rebuild();
                // From there somebody has looked up.
                cache.covers(&QueryPoint { within: f32::MAX, ..QueryPoint::open(gap, Vec3::Z) })
            };
            assert!(!wide(cache, 0.99 * factor) && wide(cache, 1.02));
        });
    }

    #[test]
    fn records_that_are_restored_say_the_same_to_the_bit() {
        let random = Random::new(3, 3);
        let point = |i: u32| Vec3::new(random.single(7_000 + 2 * i), random.single(7_001 + 2 * i), 0.5);
        with_cache(300, |cache| {
            for i in 0..300 {
                let radius = 0.3 * libm::powf(random.single(3 * i), 4.0);
                let bent = Record { bend: [radius; 2], ..record(random.single(3 * i + 1), 0.5, radius) };
                cache.insert(Record { position: point(9_000 + i).to_array(), ..bent });
            }
            let said = |cache: &IrradianceCache, i| cache.at(&QueryPoint::open(point(i), Vec3::Z));
            let covered = |cache: &IrradianceCache, i| cache.covers(&QueryPoint::open(point(i), Vec3::Z));
            let before: vec::Vec<_> = (0..500).map(|i| covered(cache, i)).collect();
            cache.rebuild();
            assert!((0..500).all(|i| covered(cache, i) == before[i as usize]));
            with_cache(300, |other| {
                other.insert(record(0.5, 0.5, 0.5));
                other.restore(cache.records());
                assert_eq!((other.records(), other.refused()), (cache.records(), 0));
                assert!((0..500).all(|i| said(other, i) == said(cache, i)));
            });
            with_cache(200, |other| {
                other.restore(cache.records());
                assert_eq!((other.records().len(), other.refused()), (200, 100));
            });
        });
    }

    /// E = 1 and 1.5 at a distance of 0.1: a curvature of 2 · 0.5 / 0.1² over 1.5. With a relative noise of a
    /// quarter each, the difference is within three standard deviations.
    #[test]
    fn records_that_disagree_shrink_unless_noise_is_an_excuse() {
        let pair = |noise| {
            with_cache(2, |cache| {
                for (x, e) in [(0.4, 1.0), (0.5, 1.5)] {
                    let flat =
                        Record { gradient: [[0.0; 2]; 3], noise, allowed: 1e-4, ..record(x, 0.5, 0.2) };
                    cache.insert(Record { irradiance: [e; 3], ..flat });
                }
                [0, 1].map(|i: usize| cache.records()[i].radii[0])
            })
        };
        let wanted = radius(1e-4, 2.0 * 0.5 / 0.01 / 1.5);
        assert!(
            pair(0.0).iter().all(|found| (found / wanted - 1.0).abs() < 1e-5),
            "{:?} {wanted}",
            pair(0.0)
        );
        assert_eq!(pair(0.0625), [0.2; 2]);
    }

    #[test]
    fn no_radius_is_larger_than_a_neighbours_and_the_distance_to_it() {
        with_cache(400, |cache| {
            let random = Random::new(2, 2);
            for i in 0..400 {
                let radius = 0.3 * libm::powf(random.single(3 * i), 4.0);
                let bent = Record {
                    error: radius * radius,
                    ..record(random.single(3 * i + 1), random.single(3 * i + 2), radius)
                };
                cache.insert(bent);
            }
            for a in cache.records() {
                for b in cache.records() {
                    let distance = Vec3::from(a.position).distance(b.position.into());
                    assert!(a.radii[0] <= b.radii[0] + distance + 1e-6);
                }
                assert!((a.radii[1] / a.radii[0] - 1.5).abs() < 1e-5);
                assert!((a.error / (a.radii[0] * a.radii[0]) - 1.0).abs() < 1e-5);
            }
        });
    }
}
