//! Irradiance record: irradiance at one point, its derivatives, and its region of validity.
//!
//! A record covers an ellipsoid with the radii R1 ≤ R2 of an error metric along the surface, and R1 across it
//! (Schwarzhaupt, Jensen and Jarosz 2012, §5). Its support may be wider, by the overlap that the metric
//! allows. A boundary excludes points behind walls from both.

use super::lanes::{One, Width};
use super::{Derivatives, Validity};
use crate::Rgb;
use crate::geometry::Frame;
use crate::sampling::ONE_MINUS_EPSILON;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use halflight_simd::Lanes;

/// Number of azimuthal sectors of a record's boundary.
pub const SECTORS: usize = 16;

/// Overlap over the cube root of the relative noise, and maximum overlap. These values minimise the error in
/// the Cornell box with 4096 rays and 500 to 5000 records.
const NOISE_TO_OVERLAP: f32 = 8.0;
const MAX_OVERLAP: f32 = 2.0;

/// Fraction of the error predicted by the Hessian that remains where several records overlap, and maximum of
/// the error before this factor, since extrapolation is clamped.
const OVERLAP_ERROR_FRACTION: f32 = 0.5;
const MAX_EXTRAPOLATION_ERROR: f32 = 0.3;

/// Maximum distance of a valid record from a point below an overhang, over the height of the overhang, since
/// light changes over such a distance there.
pub const OVERHANG_DISTANCE_FACTOR: f32 = 2.0;

/// Ratio of that distance to the largest minimum radius of a valid record; larger records are too coarse.
pub const OVERHANG_RADIUS_FACTOR: f32 = 4.0;

/// Irradiance record; see the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Record {
    // The fields that decide validity come first, in one cache line.
    /// Position x_i.
    pub position: [f32; 3],
    /// Radii of the support over those of the record.
    pub overlap: f32,
    /// Unit shading normal n_i.
    pub normal: [f32; 3],
    /// Allowed error over the support, relative to E_i, as an integral over area in m². Zero if neighbours do
    /// not correct the record.
    pub allowed: f32,
    /// Unit tangent with radius R1; the normal times this axis has R2.
    pub axis: [f32; 3],
    /// Mean relative error of extrapolation within the radii, as predicted by the metric or shown by
    /// neighbours.
    pub error: f32,
    /// Radii R1 ≤ R2 of the covered region.
    pub radii: [f32; 2],
    /// Variance of the luminance of E_i due to ray noise, over its square.
    pub noise: f32,
    /// Unit of the boundary: the longer radius of the initial support.
    pub reach: f32,
    /// Distance to the nearest wall per sector, in 255ths of `reach`; 255 if there is none within `reach`.
    pub boundary: [u8; SECTORS],
    /// E_i in W/m², without direct light of emitters.
    pub irradiance: [f32; 3],
    /// ∇E_i of each channel along the two axes, in W/m² per unit of length.
    pub gradient: [[f32; 2]; 3],
    /// ∇_n E_i of each channel along the two axes: E changes by it times n_i × n.
    pub rotation: [[f32; 2]; 3],
    /// Half of the second derivatives of E along the two axes, over E.
    pub bend: [f32; 2],
    /// Fraction of strata that see emitters or the environment directly.
    pub shining: f32,
    /// Mean of 1/t² over the strata, in 1/m².
    pub mean_square_inverse_distance: f32,
    /// Minimum of R1 in m, whatever neighbours show.
    pub least: f32,
    /// Distance per sector, in 255ths of `reach`, up to which no overhang is so close above a point that the
    /// record is invalid there.
    pub free: [u8; SECTORS],
    /// M₅/E_i of each channel, 0 … 1, with M₅ = ∫ L (1 - cos)⁵ cos dω: the light that Schlick's reflectance
    /// keeps from the base of a coat.
    pub edge_fraction: [f32; 3],
}

impl Record {
    /// Record of `derivatives` at `position` with tangent frame `frame`, valid within `reach`. Gradients are
    /// limited so that no channel becomes negative within the support.
    pub fn new(position: Vec3, frame: &Frame, derivatives: &Derivatives, reach: &Validity) -> Self {
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
        // Mean of (x² l1 + y² l2) / 2 over the ellipse.
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
            mean_square_inverse_distance: derivatives.mean_square_inverse_distance,
            allowed: reach.allowed,
            least: reach.least,
            boundary: [u8::MAX; SECTORS],
            free: [u8::MAX; SECTORS],
            edge_fraction: [0.0; 3],
        }
    }

    /// Sets M₅ of each channel.
    pub fn set_edge_moment(&mut self, moment: Rgb) {
        let fraction =
            |moment: f32, whole: f32| if whole > 0.0 { (moment / whole).clamp(0.0, 1.0) } else { 0.0 };
        let moment = moment.to_array();
        self.edge_fraction = core::array::from_fn(|i| fraction(moment[i], self.irradiance[i]));
    }

    /// Sets the relative variance of E_i. If supports may overlap, the overlap s follows from it: averaging
    /// over s radii leaves a noise of σ/s and an extrapolation error ∝ s², so the optimal s is ∝ σ^⅓. Records
    /// clamped to the minimum radius do not overlap.
    pub fn set_noise(&mut self, noise: f32) {
        self.noise = noise;
        if self.allowed > 0.0 {
            let wanted = (NOISE_TO_OVERLAP * libm::cbrtf(libm::sqrtf(noise))).clamp(1.0, MAX_OVERLAP);
            self.overlap = if self.radii[0] > self.least { wanted } else { 1.0 };
            self.reach = self.radii[1] * self.overlap;
        }
    }

    /// Record with radii scaled by `factor`, at least 1, over which light changes by as much. Walls beyond
    /// its former reach have to be found; any point there may be under an overhang.
    pub fn widened(&self, factor: f32) -> Self {
        let narrow = |free: u8| (f32::from(free) / factor) as u8;
        Self {
            radii: self.radii.map(|radius| factor * radius),
            reach: factor * self.reach,
            boundary: self.boundary.map(|free| if free == u8::MAX { free } else { narrow(free) }),
            free: self.free.map(narrow),
            gradient: self.gradient.map(|channel| channel.map(|slope| slope / factor)),
            bend: self.bend.map(|bend| bend / (factor * factor)),
            error: factor * factor * self.error,
            ..*self
        }
    }

    /// Expected mean magnitude of the relative error where this record is valid: noise, averaged over
    /// overlapping records, and extrapolation error. A normal deviate of variance 1 has the mean magnitude
    /// √(2/π).
    pub fn predicted(&self) -> f32 {
        let missed = OVERLAP_ERROR_FRACTION * self.error.min(MAX_EXTRAPOLATION_ERROR);
        let variance = self.noise / (self.overlap * self.overlap) + missed * missed;
        libm::sqrtf(core::f32::consts::FRAC_2_PI * variance)
    }

    /// Offset along the axes of position and gradient: R1, R2, normal.
    #[inline]
    pub(super) fn local(&self, offset: Vec3) -> Vec3 {
        let [first, second] = self.axes();
        Vec3::new(offset.dot(first), offset.dot(second), offset.dot(self.normal.into()))
    }

    /// Both axes of the tangent plane, of R1 and R2.
    #[inline]
    pub(crate) fn axes(&self) -> [Vec3; 2] {
        let axis = Vec3::from(self.axis);
        [axis, Vec3::from(self.normal).cross(axis)]
    }

    /// Distance of a point in radii; 1 on the border of the covered region.
    pub fn radii_to(&self, position: Vec3) -> f32 {
        let [r1, r2] = self.radii;
        (self.local(position - Vec3::from(self.position)) / Vec3::new(r1, r2, r1)).length()
    }

    /// Half edges of the bounding box of the support.
    pub fn extent(&self) -> Vec3 {
        let (axis, normal) = (Vec3::from(self.axis), Vec3::from(self.normal));
        let [r1, r2] = self.radii;
        let (a, b, c) = (self.overlap * r1 * axis, self.overlap * r2 * normal.cross(axis), r1 * normal);
        let square = a * a + b * b + c * c;
        Vec3::new(libm::sqrtf(square.x), libm::sqrtf(square.y), libm::sqrtf(square.z))
    }

    /// Stores an overhang above the sectors `first` to `last`, which may exceed 16 around the circle; it may
    /// invalidate this record at points farther than `distance`.
    pub fn add_overhang(&mut self, [first, last]: [i32; 2], distance: f32) {
        let share = self.share(distance);
        for sector in first..=last.min(first + SECTORS as i32 - 1) {
            if let Some(free) = self.free.get_mut(sector.rem_euclid(SECTORS as i32) as usize) {
                *free = (*free).min(share);
            }
        }
    }

    /// A distance as it is stored: a fraction of the reach.
    #[inline]
    pub(crate) fn share(&self, distance: f32) -> u8 {
        ((distance / self.reach).clamp(0.0, 1.0) * 255.0) as u8
    }

    /// Maximum distance of valid points by the boundary.
    pub fn farthest(&self) -> f32 {
        match self.boundary.iter().max() {
            Some(&most) if most < u8::MAX => f32::from(most) * (self.reach / f32::from(u8::MAX)),
            _ => f32::INFINITY,
        }
    }

    /// Limits the boundary to `distance` in all directions.
    pub fn confine(&mut self, distance: f32) {
        let share = self.share(distance);
        self.boundary = self.boundary.map(|free| free.min(share));
    }

    /// Stores a wall at `distance` from the record, in the direction of `place` along its axes.
    pub fn limit_boundary(&mut self, place: Vec2, distance: f32) {
        let share = self.share(distance);
        if let Some(boundary) = self.boundary.get_mut(sector(One, place.to_array()) as usize) {
            *boundary = (*boundary).min(share);
        }
    }

    /// A world direction along both axes.
    pub fn along_axes(&self, direction: Vec3) -> Vec2 {
        self.local(direction).truncate()
    }

    /// Sector in the direction of `place` along a record's axes, the inverse of [`Record::towards`]; the
    /// fraction is the position within the sector.
    pub fn sector(place: Vec2) -> f32 {
        sector(One, place.to_array())
    }

    /// Direction of `sector` along the axes and in world space, not normalised.
    pub fn towards(&self, sector: f32) -> (Vec2, Vec3) {
        // Inverse of `sector`: a position on the diamond |x| + |y| = 1.
        let angle = sector * (4.0 / SECTORS as f32);
        let x = if angle < 2.0 { 1.0 - angle } else { angle - 3.0 };
        let y = (1.0 - x.abs()).copysign(2.0 - angle);
        let (axis, normal) = (Vec3::from(self.axis), Vec3::from(self.normal));
        (Vec2::new(x, y), x * axis + y * normal.cross(axis))
    }
}

/// Sector of a direction, in the whole part: an angle of four quadrants, linear along |x| + |y| = 1.
#[inline(always)]
pub(super) fn sector<W: Width>(width: W, [x, y]: [W::L; 2]) -> W::L {
    let x = x / (x.abs() + y.abs()).max(width.all(f32::MIN_POSITIVE));
    let angle = (width.all(1.0) - x).select(width.all(0.0).le(y), width.all(3.0) + x);
    angle * width.all(0.25 * ONE_MINUS_EPSILON * SECTORS as f32)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Record of unequal derivatives and radii, without walls or overhangs.
    pub(in crate::cache::irradiance) fn record() -> Record {
        Record {
            normal: [0.0, 0.0, 1.0],
            axis: [1.0, 0.0, 0.0],
            irradiance: [2.0; 3],
            gradient: [[0.5, -1.0]; 3],
            rotation: [[0.0, 3.0]; 3],
            radii: [1.0, 2.0],
            overlap: 1.0,
            reach: 2.0,
            boundary: [u8::MAX; SECTORS],
            free: [u8::MAX; SECTORS],
            ..Record::default()
        }
    }

    #[test]
    fn the_noisier_a_record_the_wider_its_support() {
        let overlap = |noise, allowed| {
            let mut record = Record { allowed, ..record() };
            record.set_noise(noise);
            assert_eq!(record.reach, record.radii[1] * record.overlap);
            record.overlap
        };
        assert_eq!((overlap(0.0, 1.0), overlap(1.0, 1.0), overlap(1.0, 0.0)), (1.0, MAX_OVERLAP, 1.0));
        // 0.008 is 0.2 cubed.
        assert!((overlap(0.008 * 0.008, 1.0) - 0.2 * NOISE_TO_OVERLAP).abs() < 1e-5);
        assert_eq!(overlap(f32::MAX, 1.0), MAX_OVERLAP);
    }

    #[test]
    fn beyond_its_old_reach_something_may_hang_over_a_wide_record() {
        let mut near = record();
        near.boundary[3] = 100;
        let wide = near.widened(2.0);
        assert_eq!((wide.radii, wide.reach, wide.gradient[0]), ([2.0, 4.0], 4.0, [0.25, -0.5]));
        // The same distances, in 255ths of the reach.
        assert_eq!((wide.boundary[3], wide.boundary[0], wide.free), (50, u8::MAX, [127; SECTORS]));
    }

    #[test]
    fn it_predicts_its_noise_and_what_it_misses() {
        let predicted = |noise, error, overlap| Record { noise, error, overlap, ..record() }.predicted();
        let normal = libm::sqrtf(core::f32::consts::FRAC_2_PI);
        assert!((predicted(0.04, 0.0, 2.0) - 0.1 * normal).abs() < 1e-6);
        assert!((predicted(0.0, 0.2, 1.0) - 0.1 * normal).abs() < 1e-6);
        assert!((predicted(0.0, 9.0, 1.0) - 0.15 * normal).abs() < 1e-6);
    }
}
