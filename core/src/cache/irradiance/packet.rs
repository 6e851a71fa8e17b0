//! Lookup of sixteen points at once. Neighbouring pixels need the same records, so that their points descend
//! the octree together while they are in equal cells, and each record is read once for all of them.
//!
//! The plain algorithm is [`IrradianceCache::at`] for each point. A point meets equal records in equal order,
//! and the lanes do equal arithmetic: the bits are equal. The price: a point alone in its cells costs sixteen
//! lanes.

use super::lanes::{Query, QueryPoint, Sixteen};
use super::record::Record;
use super::store::{CachedIrradiance, IrradianceCache};
use crate::cache::octree::{POINTS, Visit};
use crate::{Level, Rgb};
use halflight_simd::{Kernel, Lanes, Mask, Simd};

/// Sixteen query points, by coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Points {
    position: [[f32; POINTS]; 3],
    normal: [[f32; POINTS]; 3],
    within: [f32; POINTS],
    /// Bit set of the points in use.
    wanted: u32,
}

impl Points {
    /// No point.
    pub const NONE: Points = Points {
        position: [[0.0; POINTS]; 3],
        normal: [[0.0; POINTS]; 3],
        within: [f32::INFINITY; POINTS],
        wanted: 0,
    };

    /// Sets point `i`, of [`POINTS`].
    #[inline]
    pub fn set(&mut self, i: usize, point: &QueryPoint) {
        let i = i % POINTS;
        for axis in 0..3 {
            self.position[axis][i] = point.position[axis];
            self.normal[axis][i] = point.normal[axis];
        }
        self.within[i] = point.within;
        self.wanted |= 1 << i;
    }
}

impl IrradianceCache<'_> {
    /// Writes [`IrradianceCache::at`] of each of `points` to `known`, equal to the bit; other entries remain.
    /// Returns for each point the distance to the farthest valid record that an overhang may make invalid; 0
    /// if there is none.
    pub fn at_all(
        &self,
        level: Level,
        points: &Points,
        known: &mut [Option<CachedIrradiance>; POINTS],
    ) -> [f32; POINTS] {
        self.query::<true>(level, points, known)
    }

    /// [`IrradianceCache::at_all`] for a scene without coats, with zeros for `edge_moment`.
    pub(crate) fn at_all_without_coats(
        &self,
        level: Level,
        points: &Points,
        known: &mut [Option<CachedIrradiance>; POINTS],
    ) -> [f32; POINTS] {
        self.query::<false>(level, points, known)
    }

    fn query<const COATS: bool>(
        &self,
        level: Level,
        points: &Points,
        known: &mut [Option<CachedIrradiance>; POINTS],
    ) -> [f32; POINTS] {
        if points.wanted == 0 {
            return [0.0; POINTS];
        }
        let Found { values: [red, green, blue, shining, weights, exposed], edge } =
            level.dispatch(PacketQuery::<COATS> { cache: self, points });
        let mut left = points.wanted;
        while left != 0 {
            let i = left.trailing_zeros() as usize % POINTS;
            left &= left - 1;
            let weight = weights[i];
            known[i] = (weight > 0.0).then(|| CachedIrradiance {
                irradiance: Rgb::new(red[i], green[i], blue[i]) / weight,
                edge_moment: Rgb::from(edge.map(|channel| channel[i])) / weight,
                shining: shining[i] / weight,
            });
        }
        exposed.map(libm::sqrtf)
    }
}

/// Query of sixteen points, with the moments of light for `COATS`.
struct PacketQuery<'a, const COATS: bool> {
    cache: &'a IrradianceCache<'a>,
    points: &'a Points,
}

/// Result of a query over all valid records.
struct Found {
    /// Weighted sums of irradiance per channel and of `shining`, the sum of weights, and the maximum squared
    /// distance to records that an overhang may make invalid.
    values: [[f32; POINTS]; 6],
    /// Weighted sums of M₅ per channel.
    edge: [[f32; POINTS]; 3],
}

impl<const COATS: bool> Kernel for PacketQuery<'_, COATS> {
    type Out = Found;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Out {
        let Self { cache, points: Points { position, normal, within, wanted } } = self;
        let ([x, y, z], [u, v, w]) = (position, normal);
        let query = Query {
            position: [simd.load16(x), simd.load16(y), simd.load16(z)],
            normal: [simd.load16(u), simd.load16(v), simd.load16(w)],
            within: simd.load16(within),
        };
        let (tree, records, least_cos) = cache.parts();
        let mut sums = Sums::<S, COATS> {
            simd,
            records,
            least_cos,
            query,
            sums: [simd.splat16(0.0); 5],
            edge: [simd.splat16(0.0); 3],
            exposed: simd.splat16(0.0),
        };
        tree.at_all(position, *wanted, &mut sums);
        let [a, b, c, d, e] = sums.sums;
        let exposed = sums.exposed.to_array();
        Found {
            values: [a.to_array(), b.to_array(), c.to_array(), d.to_array(), e.to_array(), exposed],
            edge: sums.edge.map(|channel| channel.to_array()),
        }
    }
}

/// Sums of a query over the records so far.
struct Sums<'a, S: Simd, const COATS: bool> {
    simd: S,
    records: &'a [Record],
    least_cos: f32,
    query: Query<S::F16>,
    sums: [S::F16; 5],
    edge: [S::F16; 3],
    exposed: S::F16,
}

impl<S: Simd, const COATS: bool> Visit for Sums<'_, S, COATS> {
    #[inline(always)]
    fn visit(&mut self, record: u32, points: u32) {
        let Some(record) = self.records.get(record as usize) else { return };
        let width = Sixteen(self.simd);
        let (is_valid, weight) = record.weigh(width, &self.query, self.least_cos, record.overlap);
        let is_valid = is_valid & self.simd.mask16(points);
        if !is_valid.any() {
            return;
        }
        let [red, green, blue] = record.extrapolate(width, &weight);
        let terms = [red, green, blue, self.simd.splat16(record.shining), self.simd.splat16(1.0)];
        for (sum, term) in self.sums.iter_mut().zip(terms) {
            *sum = (*sum + weight.weight * term).select(is_valid, *sum);
        }
        if COATS {
            for ((sum, channel), fraction) in
                self.edge.iter_mut().zip([red, green, blue]).zip(record.edge_fraction)
            {
                let term = channel * self.simd.splat16(fraction);
                *sum = (*sum + weight.weight * term).select(is_valid, *sum);
            }
        }
        if record.is_free() {
            return;
        }
        let exposed = record.square_exposed(width, weight.place);
        self.exposed = self.exposed.max(exposed).select(is_valid, self.exposed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::irradiance::SECTORS;
    use crate::geometry::Bounds;
    use crate::memory::{Arena, Line};
    use crate::sampling::Random;
    use glam::Vec3;
    use std::vec;

    const RECORDS: u32 = 500;

    /// Point on one of the floors at z = 0, 1/2 and 1 of the unit cube.
    fn place(random: &Random, i: u32) -> Vec3 {
        let [x, y, z] = [0, 1, 2].map(|k| random.single(3 * i + k));
        Vec3::new(x, y, libm::floorf(3.0 * z) * 0.5)
    }

    /// Normal with up to a tenth in x and y.
    fn normal(random: &Random, i: u32) -> Vec3 {
        let [x, y] = [0, 1].map(|k| 0.2 * (random.single(2 * i + k) - 0.5));
        Vec3::new(x, y, 1.0).normalize()
    }

    /// Records of all sizes, some with walls, some with weights by variance.
    fn record(i: u32) -> Record {
        let random = Random::new(7, i);
        let number = |k: u32| random.single(1000 + k);
        let (normal, axis) = (normal(&random, 1), Vec3::X);
        let radius = 0.02 + 0.2 * number(1);
        Record {
            position: place(&random, 0).to_array(),
            normal: normal.to_array(),
            axis: (axis - axis.dot(normal) * normal).normalize().to_array(),
            irradiance: [number(2), number(3), number(4)],
            gradient: [[number(5) - 0.5, number(6)]; 3],
            rotation: [[number(7), number(8) - 0.5]; 3],
            bend: [number(9) - 0.5, number(10)],
            radii: [radius, 1.5 * radius],
            overlap: 1.0 + number(11),
            reach: 1.5 * radius * (1.0 + number(11)),
            allowed: if number(12) < 0.5 { 0.0 } else { 1e3 },
            noise: 0.01 * number(13),
            error: number(14),
            shining: number(15),
            boundary: core::array::from_fn(|k| if number(16) < 0.3 { 255 } else { (200 + 4 * k) as u8 }),
            free: core::array::from_fn(|k| if number(17) < 0.3 { 255 } else { (100 + 4 * k) as u8 }),
            least: 0.01 * number(18),
            edge_fraction: [number(19), number(20), number(21)],
            ..Record::default()
        }
    }

    /// Compares the lookup of `points` at all levels with that of each point alone. Returns the number of
    /// known points.
    #[track_caller]
    fn check(cache: &IrradianceCache, points: &[QueryPoint]) -> usize {
        let mut query = Points::NONE;
        points.iter().enumerate().for_each(|(i, point)| query.set(i, point));
        let alone = |i: usize| points.get(i).and_then(|point| cache.at(point));
        let wanted: [Option<CachedIrradiance>; POINTS] = core::array::from_fn(alone);
        for level in Level::detect().and_below() {
            let mut known = [None; POINTS];
            let exposed = cache.at_all(level, &query, &mut known);
            assert_eq!(known, wanted, "{}", level.name());
            let mut without_coats = [None; POINTS];
            assert_eq!(cache.at_all_without_coats(level, &query, &mut without_coats), exposed);
            let no_edge = |known: CachedIrradiance| CachedIrradiance { edge_moment: Rgb::ZERO, ..known };
            assert_eq!(without_coats, wanted.map(|known| known.map(no_edge)), "{}", level.name());
            for (point, exposed) in points.iter().zip(exposed) {
                let mut farthest = 0.0f32;
                cache.visit(point, |record, _| farthest = farthest.max(record.exposed(point)));
                assert_eq!(exposed, farthest);
            }
        }
        wanted.iter().flatten().count()
    }

    #[test]
    fn points_find_together_what_each_finds_alone() {
        assert_eq!(SECTORS, 16);
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let mut lines = vec![Line([0; 64]); IrradianceCache::footprint(RECORDS as usize).bytes() / 64];
        let mut arena = Arena::over(&mut lines);
        let mut cache = IrradianceCache::new(&bounds, RECORDS as usize, &mut arena).unwrap();
        assert_eq!(check(&cache, &[QueryPoint::open(Vec3::splat(0.5), Vec3::Z)]), 0);
        (0..RECORDS).for_each(|i| _ = cache.insert(record(i)));
        let random = Random::new(5, 5);
        let mut known = 0;
        for i in 0..500u32 {
            // Neighbours, and unrelated points; also fewer than sixteen, and none.
            let size = if i % 2 == 0 { 0.02 } else { 1.0 };
            let middle = place(&random, i);
            let points: vec::Vec<_> = (0..(i as usize * 7 % 17) as u32)
                .map(|k| {
                    let beside = place(&random, 10_000 + 16 * i + k);
                    let position = middle + size * Vec3::new(beside.x - middle.x, beside.y - middle.y, 0.0);
                    // Some points are below an overhang.
                    let within = if k % 3 == 0 { 0.1 * random.single(50_000 + i) } else { f32::INFINITY };
                    QueryPoint { position, normal: normal(&random, 90_000 + 16 * i + k), within }
                })
                .collect();
            known += check(&cache, &points);
        }
        assert!(known > 3000, "{known}");
        let nowhere = [Vec3::splat(2.0), Vec3::NAN, Vec3::NEG_INFINITY].map(|p| QueryPoint::open(p, Vec3::Z));
        assert_eq!(check(&cache, &nowhere), 0);
    }
}
