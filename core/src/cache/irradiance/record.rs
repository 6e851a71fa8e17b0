//! One place where the indirect irradiance is known: how it changes around, and how far that may be trusted.
//!
//! A record covers an ellipsoid: the two radii R1 ≤ R2 that an error metric gives along the surface, and R1 across it
//! (Schwarzhaupt, Jensen and Jarosz 2012, §5). Its support may be wider, by the overlap that the metric allows. A fence
//! cuts out of both what lies behind a wall.

use super::lanes::{Asked, Asker, One, Voice, Width};
use super::{Derivatives, Reach};
use crate::Rgb;
use crate::geometry::Frame;
use crate::sampling::ONE_MINUS_EPSILON;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use halflight_simd::{Lanes, Mask, dot};

/// Azimuths for each of which a record knows how far it is to the next wall.
pub const SECTORS: usize = 16;

/// A point lies in front of a record, and is not to use it, where it is so much below the mean of both tangent planes,
/// in radii: light that the record sees from above may be hidden from it.
const IN_FRONT: f32 = 0.05;

/// Extrapolation stays within these factors of what was gathered.
const LEAST_FACTOR: f32 = 0.05;
const GREATEST_FACTOR: f32 = 20.0;

/// Overlap over the cube root of the relative noise, and the most of it: least errors in the Cornell box with 4096 rays and
/// with 500 to 5000 records.
const NOISE_TO_OVERLAP: f32 = 8.0;
const MOST_OVERLAP: f32 = 2.0;

/// Of what the Hessian says that extrapolation misses, the part that is missed where several records speak; and the most
/// of it, for extrapolation is kept within limits.
const MISSED: f32 = 0.5;
const MOST_MISSED: f32 = 0.3;

/// A point beneath something hears no record that is farther than this many times the height of what hangs
/// over it: light changes there over as little as that.
pub const CLOSE: f32 = 2.0;

/// It hears none whose least radius is more than one part in this many of that: such a record is too coarse.
pub const FINE: f32 = 4.0;

/// The least variance that a record is taken to have, relative: one that knows itself without noise is not alone.
const LEAST_NOISE: f32 = 1e-6;

/// See the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Record {
    // What decides whether it speaks for a point comes first, in one line of memory.
    /// x_i.
    pub position: [f32; 3],
    /// Radii of the support over those of the record.
    pub overlap: f32,
    /// n_i, unit: the shading normal.
    pub normal: [f32; 3],
    /// Error allowed over its support, relative to E_i: an integral over an area, m². Zero where it does not learn from
    /// its neighbours.
    pub allowed: f32,
    /// Unit tangent along which the radius is R1; along the normal times it it is R2.
    pub axis: [f32; 3],
    /// Mean relative error of extrapolation over the radii, as its metric predicts or its neighbours show.
    pub error: f32,
    /// R1 ≤ R2: what it covers.
    pub radii: [f32; 2],
    /// Variance of E_i (luminance) by the noise of its rays, over its square.
    pub noise: f32,
    /// What the fence counts in: the longer radius of the support as it was at first.
    pub reach: f32,
    /// How far it is to a wall in each sector, in 255ths of `reach`; 255: as far as it reaches.
    pub fence: [u8; SECTORS],
    /// E_i in W/m², without what emitters send directly.
    pub irradiance: [f32; 3],
    /// ∇E_i of each channel along the two axes, in W/m² per unit of length.
    pub gradient: [[f32; 2]; 3],
    /// ∇_n E_i of each channel along the two axes: E changes by it times n_i × n.
    pub rotation: [[f32; 2]; 3],
    /// Half of the second derivatives of E along the two axes, over E.
    pub bend: [f32; 2],
    /// Share of the strata in which light shines directly.
    pub shining: f32,
    /// Mean of 1/t² over the strata, in 1/m².
    pub nearness: f32,
    /// The least that R1 may be, m, whatever neighbours say.
    pub least: f32,
    /// How far nothing hangs so close over points in each sector that they must not hear it, as the fence
    /// counts.
    pub free: [u8; SECTORS],
}

impl Record {
    /// What `derivatives` say at `position`, whose tangent frame is `frame`, as far as `reach`. Gradients are kept so small
    /// that no channel falls below zero within the support.
    pub fn new(position: Vec3, frame: &Frame, derivatives: &Derivatives, reach: &Reach) -> Self {
        let axis = reach.axis;
        let along = |v: Vec2| Vec2::new(v.dot(axis), axis.perp_dot(v));
        let radii = Vec2::from(reach.radii);
        let limited = |gradient: Vec2, irradiance: f32| {
            let gradient = gradient * reach.gradient_scale;
            let change = (gradient * radii).length();
            if change > irradiance { gradient * (irradiance / change) } else { gradient }
        };
        let irradiance = derivatives.irradiance.to_array();
        let gradient = [0, 1, 2].map(|i| limited(along(derivatives.gradient[i]), irradiance[i]).to_array());
        // The mean of (x² l1 + y² l2) / 2 over the ellipse.
        let error = (radii * radii).dot(Vec2::from(reach.curvature)) / 8.0;
        Self {
            position: position.to_array(),
            normal: frame.normal.to_array(),
            axis: frame.to_world(axis.extend(0.0)).to_array(),
            irradiance,
            gradient,
            rotation: derivatives.rotation.map(|rotation| along(rotation).to_array()),
            bend: reach.bend.map(|bend| 0.5 * bend),
            radii: reach.radii,
            overlap: reach.overlap,
            reach: reach.radii[1] * reach.overlap,
            error,
            shining: 0.0,
            noise: 0.0,
            nearness: derivatives.mean_square_inverse_distance,
            allowed: reach.allowed,
            least: reach.least,
            fence: [u8::MAX; SECTORS],
            free: [u8::MAX; SECTORS],
        }
    }

    /// Takes note of the variance of E_i by noise, over its square. Where supports may overlap, they do so by what that
    /// asks for: averaging over s radii leaves a noise of σ/s, and extrapolation over them an error that grows with s²,
    /// so that their sum is least at an s that goes with the cube root of σ. Whose radii are already larger than its
    /// metric wants, for they are the least that there are, does not overlap.
    pub fn note_noise(&mut self, noise: f32) {
        self.noise = noise;
        if self.allowed > 0.0 {
            let wanted = (NOISE_TO_OVERLAP * libm::cbrtf(libm::sqrtf(noise))).clamp(1.0, MOST_OVERLAP);
            self.overlap = if self.radii[0] > self.least { wanted } else { 1.0 };
            self.reach = self.radii[1] * self.overlap;
        }
    }

    /// The same of radii so many times as large, over which light changes by as much. What hangs over it is
    /// to be looked for.
    pub fn widened(&self, factor: f32) -> Self {
        let narrow = |free: u8| if free == u8::MAX { free } else { (f32::from(free) / factor) as u8 };
        Self {
            radii: self.radii.map(|radius| factor * radius),
            reach: factor * self.reach,
            fence: self.fence.map(narrow),
            free: [u8::MAX; SECTORS],
            gradient: self.gradient.map(|channel| channel.map(|slope| slope / factor)),
            bend: self.bend.map(|bend| bend / (factor * factor)),
            error: factor * factor * self.error,
            ..*self
        }
    }

    /// The magnitude of the relative error that is expected on average where this record speaks: by its noise, of which
    /// that of its neighbours takes away as much as supports overlap, and by extrapolation. A normal deviate of variance
    /// 1 has the magnitude √(2/π).
    pub fn predicted(&self) -> f32 {
        let missed = MISSED * self.error.min(MOST_MISSED);
        let variance = self.noise / (self.overlap * self.overlap) + missed * missed;
        libm::sqrtf(core::f32::consts::FRAC_2_PI * variance)
    }

    /// Position and gradient are given in these axes: R1, R2, normal.
    #[inline]
    fn local(&self, offset: Vec3) -> Vec3 {
        let (axis, normal) = (Vec3::from(self.axis), Vec3::from(self.normal));
        Vec3::new(offset.dot(axis), offset.dot(normal.cross(axis)), offset.dot(normal))
    }

    /// How far a point is, in radii: 1 on the rim of what the record covers.
    pub fn radii_to(&self, position: Vec3) -> f32 {
        let [r1, r2] = self.radii;
        (self.local(position - Vec3::from(self.position)) / Vec3::new(r1, r2, r1)).length()
    }

    /// Half of the edges of the box around the support.
    pub fn extent(&self) -> Vec3 {
        let (axis, normal) = (Vec3::from(self.axis), Vec3::from(self.normal));
        let [r1, r2] = self.radii;
        let (a, b, c) = (self.overlap * r1 * axis, self.overlap * r2 * normal.cross(axis), r1 * normal);
        let square = a * a + b * b + c * c;
        Vec3::new(libm::sqrtf(square.x), libm::sqrtf(square.y), libm::sqrtf(square.z))
    }

    /// What this record says of E at `point`, and its weight w_i > 0 (equations 12 to 14 of the paper).
    /// `least_cos` is the cosine of the greatest deviation of the normal. `None` outside of the support.
    #[inline]
    pub fn at(&self, point: &Asker, least_cos: f32) -> Option<(Rgb, f32)> {
        let (speaks, voice) = self.listen(One, &Asked::of(point), least_cos, self.overlap);
        speaks.then(|| (Rgb::from(self.said(One, &voice)), voice.weight))
    }

    /// Whether it covers the point.
    #[inline]
    pub fn covers(&self, point: &Asker, least_cos: f32) -> bool {
        self.listen(One, &Asked::of(point), least_cos, 1.0).0
    }

    /// How far away the records must be allowed to be that the point hears for this one to be heard, where
    /// something may hang too close over it for that; 0 where nothing does.
    #[inline]
    pub(super) fn exposed(&self, point: &Asker) -> f32 {
        let place = self.along_axes(point.position - Vec3::from(self.position));
        libm::sqrtf(self.square_exposed(One, place.to_array()))
    }

    /// The square of that, of points at `place` along its axes.
    #[inline(always)]
    pub(super) fn square_exposed<W: Width>(&self, width: W, place: [W::L; 2]) -> W::L {
        let free = width.pick(&self.free, sector(width, place));
        let distance = free * width.all(self.reach / f32::from(u8::MAX));
        let [x, y] = place;
        let (square, least) = (x * x + y * y, FINE * self.least);
        let is_exposed = free.lt(width.all(f32::from(u8::MAX))) & (distance * distance).lt(square);
        square.max(width.all(least * least)).select(is_exposed, width.all(0.0))
    }

    /// Which of the points lie in a support of so many radii, and with what weight.
    #[inline(always)]
    pub(super) fn listen<W: Width>(
        &self,
        width: W,
        asked: &Asked<W::L>,
        least_cos: f32,
        overlap: f32,
    ) -> (<W::L as Lanes>::Mask, Voice<W::L>) {
        let all = |value: f32| width.all(value);
        let (zero, one) = (all(0.0), all(1.0));
        let [r1, r2] = self.radii;
        let farthest = r2 * overlap;
        let [px, py, pz] = self.position;
        let [x, y, z] = asked.position;
        let offset = [x - all(px), y - all(py), z - all(pz)];
        let [nx, ny, nz] = self.normal;
        let normal = [all(nx), all(ny), all(nz)];
        let cos = dot(asked.normal, normal);
        let near = dot(offset, offset).lt(all(farthest * farthest)) & all(least_cos).lt(cos);
        let mut voice = Voice { place: [zero; 2], turned: [zero; 2], weight: zero };
        if !near.any() {
            return (near, voice);
        }
        let (axis, across) = (self.axis, self.across());
        let axis = [all(axis[0]), all(axis[1]), all(axis[2])];
        let across = [all(across.x), all(across.y), all(across.z)];
        let (x, y, z) = (dot(offset, axis), dot(offset, across), dot(offset, normal));
        let [u, v, w] = [x * all(1.0 / (r1 * overlap)), y * all(1.0 / farthest), z * all(1.0 / r1)];
        // A support without extent holds nothing: the square is no number there.
        let square = dot([u, v, w], [u, v, w]);
        // Half of the sum of both normals, along the offset.
        let height = all(0.5) * (dot(offset, asked.normal) + z);
        let speaks = near & square.lt(one) & !height.lt(all(-IN_FRONT * r1));
        voice.place = [x, y];
        let least = (x * x + y * y).sqrt().max(all(FINE * self.least));
        let speaks = speaks & !asked.within.lt(least);
        let speaks = if self.is_fenced() { speaks & !self.is_fenced_off(width, voice.place) } else { speaks };
        // n_i × n along both axes.
        voice.turned = [-dot(asked.normal, across), dot(asked.normal, axis)];
        let tent = (one - square.sqrt()) * ((cos - all(least_cos)) * all(1.0 / (1.0 - least_cos)));
        voice.weight = tent * self.trust(width, square * all(overlap * overlap));
        (speaks, voice)
    }

    /// Its variance at the place where it is over that at the square of so many radii, which extrapolation adds to: weights
    /// that go with it make the best of records that differ. 1 where the metric does not ask neighbours.
    #[inline(always)]
    fn trust<W: Width>(&self, width: W, square: W::L) -> W::L {
        if self.allowed <= 0.0 {
            return width.all(1.0);
        }
        let noise = width.all(self.noise.max(LEAST_NOISE));
        let missed = width.all(self.error.min(1.0)) * square;
        noise / (noise + missed * missed)
    }

    /// E_i + ∇E_i · Δx + Δxᵀ H Δx / 2 + ∇_n E_i · (n_i × n), within limits; of each channel.
    #[inline(always)]
    pub(super) fn said<W: Width>(&self, width: W, voice: &Voice<W::L>) -> [W::L; 3] {
        let [x, y] = voice.place;
        let [u, v] = voice.turned;
        let bend = x * x * width.all(self.bend[0]) + y * y * width.all(self.bend[1]);
        let mut channels = [width.all(0.0); 3];
        for (channel, said) in channels.iter_mut().enumerate() {
            let ([gx, gy], [ru, rv]) = (self.gradient[channel], self.rotation[channel]);
            let change = (x * width.all(gx) + y * width.all(gy)) + (u * width.all(ru) + v * width.all(rv));
            let here = self.irradiance[channel];
            let (least, greatest) = (width.all(LEAST_FACTOR * here), width.all(GREATEST_FACTOR * here));
            let here = width.all(here);
            *said = (here + bend * here + change).max(least).min(greatest);
        }
        channels
    }

    /// The axis along which the radius is R2.
    #[inline(always)]
    fn across(&self) -> Vec3 {
        Vec3::from(self.normal).cross(Vec3::from(self.axis))
    }

    /// Whether there is a wall anywhere within its support.
    #[inline(always)]
    fn is_fenced(&self) -> bool {
        self.fence != [u8::MAX; SECTORS]
    }

    /// Whether a wall stands between the record and points at `place` along its axes.
    #[inline(always)]
    fn is_fenced_off<W: Width>(&self, width: W, place: [W::L; 2]) -> <W::L as Lanes>::Mask {
        let free = width.pick(&self.fence, sector(width, place));
        let distance = free * width.all(self.reach / f32::from(u8::MAX));
        let [x, y] = place;
        free.lt(width.all(f32::from(u8::MAX))) & (distance * distance).lt(x * x + y * y)
    }

    /// Notes that something hangs over the sectors from `first` to `last`, which count on around the circle,
    /// so close that points at more than `distance` may not hear this record.
    pub fn note_overhang(&mut self, [first, last]: [i32; 2], distance: f32) {
        let share = (distance / self.reach).clamp(0.0, 1.0);
        for sector in first..=last.min(first + SECTORS as i32 - 1) {
            if let Some(free) = self.free.get_mut(sector.rem_euclid(SECTORS as i32) as usize) {
                *free = (*free).min((share * 255.0) as u8);
            }
        }
    }

    /// Whether nothing hangs close over any point in its support.
    #[inline(always)]
    pub(super) fn is_free(&self) -> bool {
        self.free == [u8::MAX; SECTORS]
    }

    /// The farthest point that it speaks for, by its fence.
    pub fn farthest(&self) -> f32 {
        match self.fence.iter().max() {
            Some(&most) if most < u8::MAX => f32::from(most) * (self.reach / f32::from(u8::MAX)),
            _ => f32::INFINITY,
        }
    }

    /// It speaks for nothing that is farther than `distance`, in whatever direction.
    pub fn confine(&mut self, distance: f32) {
        let share = (distance / self.reach).clamp(0.0, 1.0);
        self.fence = self.fence.map(|free| free.min((share * 255.0) as u8));
    }

    /// Notes a wall at `distance` from the record, in the direction of `place` along its axes.
    pub fn fence_off(&mut self, place: Vec2, distance: f32) {
        let share = (distance / self.reach).clamp(0.0, 1.0);
        if let Some(fence) = self.fence.get_mut(sector(One, place.to_array()) as usize) {
            *fence = (*fence).min((share * 255.0) as u8);
        }
    }

    /// A direction of the world along the two axes.
    pub fn along_axes(&self, direction: Vec3) -> Vec2 {
        self.local(direction).truncate()
    }

    /// The sector in the direction of `place` along a record's axes, as [`Record::towards`] takes it: the fraction says
    /// where in it.
    pub fn sector(place: Vec2) -> f32 {
        sector(One, place.to_array())
    }

    /// The direction of the middle of a sector, in the world; not of unit length.
    pub fn towards(&self, sector: f32) -> (Vec2, Vec3) {
        // The inverse of `sector`: a walk around the diamond |x| + |y| = 1.
        let angle = sector * (4.0 / SECTORS as f32);
        let x = if angle < 2.0 { 1.0 - angle } else { angle - 3.0 };
        let y = (1.0 - x.abs()).copysign(2.0 - angle);
        let (axis, normal) = (Vec3::from(self.axis), Vec3::from(self.normal));
        (Vec2::new(x, y), x * axis + y * normal.cross(axis))
    }
}

/// The sector of a direction, as the whole part: an angle of four quadrants, linear along |x| + |y| = 1.
#[inline(always)]
fn sector<W: Width>(width: W, [x, y]: [W::L; 2]) -> W::L {
    let x = x / (x.abs() + y.abs()).max(width.all(f32::MIN_POSITIVE));
    let angle = (width.all(1.0) - x).select(width.all(0.0).le(y), width.all(3.0) + x);
    angle * width.all(0.25 * ONE_MINUS_EPSILON * SECTORS as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> Record {
        Record {
            normal: [0.0, 0.0, 1.0],
            axis: [1.0, 0.0, 0.0],
            irradiance: [2.0; 3],
            gradient: [[0.5, -1.0]; 3],
            rotation: [[0.0, 3.0]; 3],
            radii: [1.0, 2.0],
            overlap: 1.0,
            reach: 2.0,
            fence: [u8::MAX; SECTORS],
            free: [u8::MAX; SECTORS],
            ..Record::default()
        }
    }

    const LEAST_COS: f32 = 0.98;

    #[test]
    fn it_extrapolates_along_its_axes_and_weighs_by_the_tent() {
        let (e, w) = record().at(&Asker::open(Vec3::new(0.5, 0.0, 0.0), Vec3::Z), LEAST_COS).unwrap();
        assert!((e.x - 2.25).abs() < 1e-6 && (w - 0.5).abs() < 1e-6, "{e} {w}");
        let (e, w) = record().at(&Asker::open(Vec3::new(0.0, 1.0, 0.0), Vec3::Z), LEAST_COS).unwrap();
        assert!((e.x - 1.0).abs() < 1e-6 && (w - 0.5).abs() < 1e-6, "{e} {w}");
        // Turned about x by 0.1: n_i × n = (sin, 0, 0) reversed; about y: along the second axis.
        let normal = Vec3::new(0.1f32.sin(), 0.0, 0.1f32.cos());
        let (e, w) = record().at(&Asker::open(Vec3::ZERO, normal), LEAST_COS).unwrap();
        assert!((e.x - (2.0 + 3.0 * 0.1f32.sin())).abs() < 1e-6, "{e}");
        assert!((w - (0.1f32.cos() - LEAST_COS) / (1.0 - LEAST_COS)).abs() < 1e-4, "{w}");
    }

    #[test]
    fn it_overlaps_others_and_bends() {
        let record = Record { overlap: 2.0, bend: [0.0, 0.25], reach: 4.0, ..record() };
        let (e, w) = record.at(&Asker::open(Vec3::new(0.0, 3.0, 0.0), Vec3::Z), LEAST_COS).unwrap();
        assert!((e.x - (2.0 - 3.0 + 2.0 * 0.25 * 9.0)).abs() < 1e-5 && (w - 0.25).abs() < 1e-6, "{e} {w}");
        assert!(record.at(&Asker::open(Vec3::new(0.0, 4.0, 0.0), Vec3::Z), LEAST_COS).is_none());
        let covers = |y| record.covers(&Asker::open(Vec3::new(0.0, y, 0.0), Vec3::Z), LEAST_COS);
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
            assert!(record.at(&Asker::open(Vec3::new(x, y, z), Vec3::Z), LEAST_COS).is_none(), "{x} {y} {z}");
        }
        assert!(record.at(&Asker::open(Vec3::ZERO, Vec3::new(0.3, 0.0, 0.954)), LEAST_COS).is_none());
        assert!(record.at(&Asker::open(Vec3::ZERO, Vec3::NEG_Z), LEAST_COS).is_none());
        assert!(
            Record { radii: [0.0; 2], ..record }.at(&Asker::open(Vec3::ZERO, Vec3::Z), LEAST_COS).is_none()
        );
    }

    #[test]
    fn what_it_says_stays_between_limits() {
        let steep = Record { gradient: [[100.0, 0.0]; 3], ..record() };
        let at = |x| steep.at(&Asker::open(Vec3::new(x, 0.0, 0.0), Vec3::Z), LEAST_COS).unwrap().0.x;
        assert_eq!((at(0.9), at(-0.9)), (40.0, 0.1));
    }

    #[test]
    fn the_noisier_a_record_the_wider_its_support() {
        let overlap = |noise, allowed| {
            let mut record = Record { allowed, ..record() };
            record.note_noise(noise);
            assert_eq!(record.reach, record.radii[1] * record.overlap);
            record.overlap
        };
        assert_eq!((overlap(0.0, 1.0), overlap(1.0, 1.0), overlap(1.0, 0.0)), (1.0, MOST_OVERLAP, 1.0));
        // 0.008 is the cube of 0.2.
        assert!((overlap(0.008 * 0.008, 1.0) - 0.2 * NOISE_TO_OVERLAP).abs() < 1e-5);
        assert_eq!(overlap(f32::MAX, 1.0), MOST_OVERLAP);
    }

    #[test]
    fn it_predicts_its_noise_and_what_it_misses() {
        let predicted = |noise, error, overlap| Record { noise, error, overlap, ..record() }.predicted();
        let normal = libm::sqrtf(core::f32::consts::FRAC_2_PI);
        assert!((predicted(0.04, 0.0, 2.0) - 0.1 * normal).abs() < 1e-6);
        assert!((predicted(0.0, 0.2, 1.0) - 0.1 * normal).abs() < 1e-6);
        assert!((predicted(0.0, 9.0, 1.0) - 0.15 * normal).abs() < 1e-6);
    }

    #[test]
    fn a_fence_hides_what_is_behind_it_and_nothing_else() {
        let mut record = record();
        for i in 0..SECTORS {
            let (place, world) = record.towards(i as f32 + 0.5);
            assert!((Record::sector(place) - (i as f32 + 0.5)).abs() < 1e-5);
            assert!(place.extend(0.0).distance(world) < 1e-6);
        }
        record.fence_off(Vec2::new(0.0, 1.0), 0.5);
        let at = |x, y| record.at(&Asker::open(Vec3::new(x, y, 0.0), Vec3::Z), LEAST_COS).is_some();
        assert!(at(0.01, 0.49) && !at(0.01, 0.51) && at(-0.01, 0.51) && at(0.01, -0.51) && at(0.51, 0.0));
        let bounds = record.extent();
        assert_eq!(bounds, Vec3::new(1.0, 2.0, 1.0));
    }

    #[test]
    fn what_hangs_close_over_a_point_silences_what_is_far_or_coarse() {
        let at = |record: &Record, x: f32, within: f32| {
            let point = Asker { within, ..Asker::open(Vec3::new(x, 0.0, 0.0), Vec3::Z) };
            record.at(&point, LEAST_COS).is_some()
        };
        let fine = record();
        assert!(at(&fine, 0.5, f32::INFINITY) && at(&fine, 0.5, 0.51) && !at(&fine, 0.5, 0.49));
        let coarse = Record { least: 0.1, ..fine };
        assert!(at(&coarse, 0.1, FINE * 0.101) && !at(&coarse, 0.1, FINE * 0.099));
        assert!(at(&coarse, 0.5, f32::INFINITY));
    }

    #[test]
    fn points_are_exposed_beyond_what_was_noted_in_their_sector() {
        let mut record = record();
        let exposed =
            |record: &Record, x: f32, y: f32| record.exposed(&Asker::open(Vec3::new(x, y, 0.0), Vec3::Z));
        assert!(record.is_free() && exposed(&record, 0.9, 0.0) == 0.0);
        let sector = Record::sector(Vec2::new(0.9, 0.1)) as i32;
        record.note_overhang([sector, sector], 0.5);
        assert!(!record.is_free() && exposed(&record, 0.4, 0.05) == 0.0);
        assert!((exposed(&record, 0.8, 0.08) - 0.8f32.hypot(0.08)).abs() < 1e-6);
        assert_eq!((exposed(&record, 0.0, 0.9), exposed(&record, -0.9, 0.1)), (0.0, 0.0));
        // Around the circle, and no farther.
        record.note_overhang([-1, 40], 0.0);
        assert_eq!(record.free, [0; SECTORS]);
        assert_eq!(record.farthest(), f32::INFINITY);
        record.confine(0.5);
        assert!((record.farthest() - 0.5).abs() < record.reach / 255.0 && record.farthest() <= 0.5);
    }
}
