//! Extrapolated irradiance and weight of a record at one or sixteen points.

use super::lanes::{One, Query, QueryPoint, RecordWeight, Width};
use super::record::{OVERHANG_RADIUS_FACTOR, Record, SECTORS, sector};
use crate::Rgb;
use glam::Vec3;
use halflight_simd::{Lanes, Mask, dot};

/// Depth below the mean of both tangent planes, in radii, beyond which a point lies in front of a record and
/// does not use it: light that the record sees from above may be hidden there.
const IN_FRONT: f32 = 0.05;

/// Limits of extrapolation, in factors of the gathered irradiance.
const LEAST_FACTOR: f32 = 0.05;
const GREATEST_FACTOR: f32 = 20.0;

/// Minimum relative variance of a record; one without noise would suppress all others.
const LEAST_NOISE: f32 = 1e-6;

/// Factor on the distance to a point, since a point on the rim of a record is outside.
const BEYOND: f32 = 1.001;

impl Record {
    /// Irradiance that this record extrapolates to `point`, and its weight w_i > 0 (equations 12 to 14 of the
    /// paper). `least_cos` is the cosine of the maximum angle between normals. `None` outside the support.
    #[inline]
    pub fn at(&self, point: &QueryPoint, least_cos: f32) -> Option<(Rgb, f32)> {
        let (is_valid, weight) = self.weigh(One, &Query::of(point), least_cos, self.overlap);
        is_valid.then(|| (Rgb::from(self.extrapolate(One, &weight)), weight.weight))
    }

    /// Weight of the record at the point, with a support of at most `support` radii. `None` outside.
    #[inline]
    pub(super) fn weight(&self, point: &QueryPoint, least_cos: f32, support: f32) -> Option<f32> {
        let (is_valid, weight) = self.weigh(One, &Query::of(point), least_cos, self.overlap.min(support));
        is_valid.then_some(weight.weight)
    }

    /// True if the record covers the point.
    #[inline]
    pub fn covers(&self, point: &QueryPoint, least_cos: f32) -> bool {
        self.weigh(One, &Query::of(point), least_cos, 1.0).0
    }

    /// Factor by which the record has to be widened to cover `point`; `None` above `most`, or if no factor
    /// does.
    pub(super) fn widening(&self, point: &QueryPoint, least_cos: f32, most: f32) -> Option<f32> {
        if point.normal.dot(self.normal.into()) <= least_cos {
            return None;
        }
        let factor = (BEYOND * self.radii_to(point.position)).max(1.0);
        (factor <= most && self.widened(factor).covers(point, least_cos)).then_some(factor)
    }

    /// Distance to the point, if an overhang may be so close above the point that the record is invalid
    /// there; otherwise 0.
    #[inline]
    pub(super) fn exposed(&self, point: &QueryPoint) -> f32 {
        let place = self.along_axes(point.position - Vec3::from(self.position));
        libm::sqrtf(self.square_exposed(One, place.to_array()))
    }

    /// Square of [`Self::exposed`] for points at `place` along the axes.
    #[inline(always)]
    pub(super) fn square_exposed<W: Width>(&self, width: W, place: [W::L; 2]) -> W::L {
        let free = width.pick(&self.free, sector(width, place));
        let distance = free * width.all(self.reach / f32::from(u8::MAX));
        let [x, y] = place;
        let (square, least) = (x * x + y * y, OVERHANG_RADIUS_FACTOR * self.least);
        let is_exposed = free.lt(width.all(f32::from(u8::MAX))) & (distance * distance).lt(square);
        square.max(width.all(least * least)).select(is_exposed, width.all(0.0))
    }

    /// Mask of the points within a support scaled by `overlap`, and their weights.
    #[inline(always)]
    pub(super) fn weigh<W: Width>(
        &self,
        width: W,
        query: &Query<W::L>,
        least_cos: f32,
        overlap: f32,
    ) -> (<W::L as Lanes>::Mask, RecordWeight<W::L>) {
        let all = |value: f32| width.all(value);
        let (zero, one) = (all(0.0), all(1.0));
        let [r1, r2] = self.radii;
        let farthest = r2 * overlap;
        let [px, py, pz] = self.position;
        let [x, y, z] = query.position;
        let offset = [x - all(px), y - all(py), z - all(pz)];
        let [nx, ny, nz] = self.normal;
        let normal = [all(nx), all(ny), all(nz)];
        let cos = dot(query.normal, normal);
        let near = dot(offset, offset).lt(all(farthest * farthest)) & all(least_cos).lt(cos);
        let mut weight = RecordWeight { place: [zero; 2], turned: [zero; 2], weight: zero };
        if !near.any() {
            return (near, weight);
        }
        let (axis, across) = (self.axis, self.across());
        let axis = [all(axis[0]), all(axis[1]), all(axis[2])];
        let across = [all(across.x), all(across.y), all(across.z)];
        let (x, y, z) = (dot(offset, axis), dot(offset, across), dot(offset, normal));
        let [u, v, w] = [x * all(1.0 / (r1 * overlap)), y * all(1.0 / farthest), z * all(1.0 / r1)];
        // A support without extent contains no point: the square is NaN.
        let square = dot([u, v, w], [u, v, w]);
        // Offset along half of the sum of both normals.
        let height = all(0.5) * (dot(offset, query.normal) + z);
        let is_valid = near & square.lt(one) & !height.lt(all(-IN_FRONT * r1));
        weight.place = [x, y];
        let least = (x * x + y * y).sqrt().max(all(OVERHANG_RADIUS_FACTOR * self.least));
        let is_valid = is_valid & !query.within.lt(least);
        let is_valid =
            if self.is_fenced() { is_valid & !self.is_fenced_off(width, weight.place) } else { is_valid };
        // n_i × n along both axes.
        weight.turned = [-dot(query.normal, across), dot(query.normal, axis)];
        let tent = (one - square.sqrt()) * ((cos - all(least_cos)) * all(1.0 / (1.0 - least_cos)));
        weight.weight = tent * self.inverse_variance(width, square * all(overlap * overlap));
        (is_valid, weight)
    }

    /// Variance of E_i over the variance at the squared distance `square` in radii, which includes the error
    /// of extrapolation. Weights ∝ inverse variance combine contradicting records. 1 if the metric does not
    /// compare neighbours.
    #[inline(always)]
    fn inverse_variance<W: Width>(&self, width: W, square: W::L) -> W::L {
        if self.allowed <= 0.0 {
            return width.all(1.0);
        }
        let noise = width.all(self.noise.max(LEAST_NOISE));
        let missed = width.all(self.error.min(1.0)) * square;
        noise / (noise + missed * missed)
    }

    /// E_i + ∇E_i · Δx + Δxᵀ H Δx / 2 + ∇_n E_i · (n_i × n), within limits, per channel.
    #[inline(always)]
    pub(super) fn extrapolate<W: Width>(&self, width: W, weight: &RecordWeight<W::L>) -> [W::L; 3] {
        let [x, y] = weight.place;
        let [u, v] = weight.turned;
        let bend = x * x * width.all(self.bend[0]) + y * y * width.all(self.bend[1]);
        let mut channels = [width.all(0.0); 3];
        for (channel, value) in channels.iter_mut().enumerate() {
            let ([gx, gy], [ru, rv]) = (self.gradient[channel], self.rotation[channel]);
            let change = (x * width.all(gx) + y * width.all(gy)) + (u * width.all(ru) + v * width.all(rv));
            let here = self.irradiance[channel];
            let (least, greatest) = (width.all(LEAST_FACTOR * here), width.all(GREATEST_FACTOR * here));
            let here = width.all(here);
            *value = (here + bend * here + change).max(least).min(greatest);
        }
        channels
    }

    /// Axis of the radius R2.
    #[inline(always)]
    fn across(&self) -> Vec3 {
        Vec3::from(self.normal).cross(Vec3::from(self.axis))
    }

    /// True if any sector has a wall within the support.
    #[inline(always)]
    fn is_fenced(&self) -> bool {
        self.boundary != [u8::MAX; SECTORS]
    }

    /// True for points at `place` along the axes that a wall separates from the record.
    #[inline(always)]
    fn is_fenced_off<W: Width>(&self, width: W, place: [W::L; 2]) -> <W::L as Lanes>::Mask {
        let free = width.pick(&self.boundary, sector(width, place));
        let distance = free * width.all(self.reach / f32::from(u8::MAX));
        let [x, y] = place;
        free.lt(width.all(f32::from(u8::MAX))) & (distance * distance).lt(x * x + y * y)
    }

    /// True if no overhang is close above any point of the support.
    #[inline(always)]
    pub(super) fn is_free(&self) -> bool {
        self.free == [u8::MAX; SECTORS]
    }
}

#[cfg(test)]
mod tests {
    use super::super::record::tests::record;
    use super::*;
    use glam::Vec2;

    const LEAST_COS: f32 = 0.98;

    #[test]
    fn it_extrapolates_along_its_axes_and_weighs_by_the_tent() {
        let (e, w) = record().at(&QueryPoint::open(Vec3::new(0.5, 0.0, 0.0), Vec3::Z), LEAST_COS).unwrap();
        assert!((e.x - 2.25).abs() < 1e-6 && (w - 0.5).abs() < 1e-6, "{e} {w}");
        let (e, w) = record().at(&QueryPoint::open(Vec3::new(0.0, 1.0, 0.0), Vec3::Z), LEAST_COS).unwrap();
        assert!((e.x - 1.0).abs() < 1e-6 && (w - 0.5).abs() < 1e-6, "{e} {w}");
        // Turned about x by 0.1: n_i × n is (sin, 0, 0) reversed; about y: along the second axis.
        let normal = Vec3::new(0.1f32.sin(), 0.0, 0.1f32.cos());
        let (e, w) = record().at(&QueryPoint::open(Vec3::ZERO, normal), LEAST_COS).unwrap();
        assert!((e.x - (2.0 + 3.0 * 0.1f32.sin())).abs() < 1e-6, "{e}");
        assert!((w - (0.1f32.cos() - LEAST_COS) / (1.0 - LEAST_COS)).abs() < 1e-4, "{w}");
    }

    #[test]
    fn it_overlaps_others_and_bends() {
        let record = Record { overlap: 2.0, bend: [0.0, 0.25], reach: 4.0, ..record() };
        let (e, w) = record.at(&QueryPoint::open(Vec3::new(0.0, 3.0, 0.0), Vec3::Z), LEAST_COS).unwrap();
        assert!((e.x - (2.0 - 3.0 + 2.0 * 0.25 * 9.0)).abs() < 1e-5 && (w - 0.25).abs() < 1e-6, "{e} {w}");
        assert!(record.at(&QueryPoint::open(Vec3::new(0.0, 4.0, 0.0), Vec3::Z), LEAST_COS).is_none());
        let covers = |y| record.covers(&QueryPoint::open(Vec3::new(0.0, y, 0.0), Vec3::Z), LEAST_COS);
        assert_eq!((record.radii_to(Vec3::new(0.0, 3.0, 0.0)), record.radii_to(Vec3::X)), (1.5, 1.0));
        assert!(covers(1.9) && !covers(2.1));
        assert_eq!(record.extent(), Vec3::new(2.0, 4.0, 1.0));
    }

    #[test]
    fn outside_of_its_support_it_says_nothing() {
        let record = record();
        for (x, y, z) in
            [(1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0), (0.8, 1.3, 0.0), (0.0, 0.0, -0.2)]
        {
            assert!(
                record.at(&QueryPoint::open(Vec3::new(x, y, z), Vec3::Z), LEAST_COS).is_none(),
                "{x} {y} {z}"
            );
        }
        assert!(record.at(&QueryPoint::open(Vec3::ZERO, Vec3::new(0.3, 0.0, 0.954)), LEAST_COS).is_none());
        assert!(record.at(&QueryPoint::open(Vec3::ZERO, Vec3::NEG_Z), LEAST_COS).is_none());
        assert!(
            Record { radii: [0.0; 2], ..record }
                .at(&QueryPoint::open(Vec3::ZERO, Vec3::Z), LEAST_COS)
                .is_none()
        );
    }

    #[test]
    fn what_it_says_stays_between_limits() {
        let steep = Record { gradient: [[100.0, 0.0]; 3], ..record() };
        let at = |x| steep.at(&QueryPoint::open(Vec3::new(x, 0.0, 0.0), Vec3::Z), LEAST_COS).unwrap().0.x;
        assert_eq!((at(0.9), at(-0.9)), (40.0, 0.1));
    }

    #[test]
    fn a_fence_hides_what_is_behind_it_and_nothing_else() {
        let mut record = record();
        for i in 0..SECTORS {
            let (place, world) = record.towards(i as f32 + 0.5);
            assert!((Record::sector(place) - (i as f32 + 0.5)).abs() < 1e-5);
            assert!(place.extend(0.0).distance(world) < 1e-6);
        }
        record.limit_boundary(Vec2::new(0.0, 1.0), 0.5);
        let at = |x, y| record.at(&QueryPoint::open(Vec3::new(x, y, 0.0), Vec3::Z), LEAST_COS).is_some();
        assert!(at(0.01, 0.49) && !at(0.01, 0.51) && at(-0.01, 0.51) && at(0.01, -0.51) && at(0.51, 0.0));
        let bounds = record.extent();
        assert_eq!(bounds, Vec3::new(1.0, 2.0, 1.0));
    }

    #[test]
    fn what_hangs_close_over_a_point_silences_what_is_far_or_coarse() {
        let at = |record: &Record, x: f32, within: f32| {
            let point = QueryPoint { within, ..QueryPoint::open(Vec3::new(x, 0.0, 0.0), Vec3::Z) };
            record.at(&point, LEAST_COS).is_some()
        };
        let fine = record();
        assert!(at(&fine, 0.5, f32::INFINITY) && at(&fine, 0.5, 0.51) && !at(&fine, 0.5, 0.49));
        let coarse = Record { least: 0.1, ..fine };
        assert!(
            at(&coarse, 0.1, OVERHANG_RADIUS_FACTOR * 0.101)
                && !at(&coarse, 0.1, OVERHANG_RADIUS_FACTOR * 0.099)
        );
        assert!(at(&coarse, 0.5, f32::INFINITY));
    }

    #[test]
    fn points_are_exposed_beyond_what_was_noted_in_their_sector() {
        let mut record = record();
        let exposed = |record: &Record, x: f32, y: f32| {
            record.exposed(&QueryPoint::open(Vec3::new(x, y, 0.0), Vec3::Z))
        };
        assert!(record.is_free() && exposed(&record, 0.9, 0.0) == 0.0);
        let sector = Record::sector(Vec2::new(0.9, 0.1)) as i32;
        record.add_overhang([sector, sector], 0.5);
        assert!(!record.is_free() && exposed(&record, 0.4, 0.05) == 0.0);
        assert!((exposed(&record, 0.8, 0.08) - 0.8f32.hypot(0.08)).abs() < 1e-6);
        assert_eq!((exposed(&record, 0.0, 0.9), exposed(&record, -0.9, 0.1)), (0.0, 0.0));
        // Beyond the whole circle, no further.
        record.add_overhang([-1, 40], 0.0);
        assert_eq!(record.free, [0; SECTORS]);
        assert_eq!(record.farthest(), f32::INFINITY);
        record.confine(0.5);
        assert!((record.farthest() - 0.5).abs() < record.reach / 255.0 && record.farthest() <= 0.5);
    }
}
