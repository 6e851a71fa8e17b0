//! Mutual correction of neighbouring records: radii of records that contradict each other beyond their noise
//! shrink, and no radius is much larger than that of a neighbour.

use super::lanes::QueryPoint;
use super::record::Record;
use super::validity::radius;
use crate::cache::octree::Octree;
use crate::light::luminance;
use glam::Vec3;

/// Minimum cosine of the normals of records that clamp each other, 60 degrees.
const MIN_NORMAL_COSINE: f32 = 0.5;

/// Standard deviations of noise within which contradicting records may both be right.
const NOISE_DEVIATIONS: f32 = 3.0;

/// Variance of a gradient over the product of the irradiance's variance and the mean of 1/t².
pub(in crate::cache) const GRADIENT_VARIANCE: f32 = 16.0;

/// Maximum number of neighbours to which a new record is compared.
const MAX_COMPARED: usize = 32;

/// Records of a cache, and the octree over them.
pub(super) struct Neighbours<'a, 'm, P> {
    pub(super) records: &'a mut [Record],
    pub(super) tree: &'a Octree<'m>,
    /// Cosine of the maximum angle between normals.
    pub(super) least_cos: f32,
    /// True for records, by number, of the same kind of light as the new one.
    pub(super) is_alike: P,
}

impl<P: Fn(u32, &Record) -> bool> Neighbours<'_, '_, P> {
    /// Compares the extrapolations of a new record and its neighbours. A hemisphere does not show, for
    /// example, a surface that comes into sight a step farther; a neighbour does. A contradiction beyond
    /// noise counts as curvature: both radii shrink to those of this curvature, and the wrong record gets
    /// less weight.
    pub(super) fn compare(&mut self, new: &mut Record) {
        if new.allowed <= 0.0 {
            return;
        }
        let position = Vec3::from(new.position);
        let mut found = [(0u32, [0.0f32; 2]); MAX_COMPARED];
        let mut count = 0;
        let (records, least_cos) = (&*self.records, self.least_cos);
        let alike = |index: u32| records.get(index as usize).filter(|other| (self.is_alike)(index, other));
        // Curvatures of the errors of the new record and of the other.
        let mut add = |index: u32, curvatures: [f32; 2]| {
            if curvatures != [0.0; 2]
                && let Some(slot) = found.get_mut(count)
            {
                *slot = (index, curvatures);
                count += 1;
            }
            count < MAX_COMPARED
        };
        let this = *new;
        self.tree.at(position, |index| {
            let other = alike(index);
            add(index, [0.0, other.map_or(0.0, |other| other.contradiction(&this, least_cos))])
        });
        self.tree.around(position, new.extent().max_element(), |index| {
            let other = alike(index);
            add(index, [other.map_or(0.0, |other| this.contradiction(other, least_cos)), 0.0]);
        });
        for &(index, [of_new, of_other]) in found.iter().take(count) {
            let radius = radius(new.allowed, of_new.max(of_other));
            new.raise_error(of_new);
            new.shrink(radius.max(new.least));
            if let Some(other) = self.records.get_mut(index as usize) {
                other.raise_error(of_other);
                other.shrink(radius.max(other.least));
                let (position, normal, radius) = (other.position.into(), other.normal.into(), other.radii[0]);
                self.clamp_around(position, normal, radius);
            }
        }
    }

    /// Neighbour clamping (Křivánek et al. 2006, section 4): what limits the radius of one record is farther
    /// from another by at most their distance, so that no radius exceeds that of a neighbour plus the
    /// distance to it. Visits all records that may clamp the new one or be clamped by it.
    pub(super) fn clamp(&mut self, new: &mut Record) {
        let (position, normal) = (Vec3::from(new.position), Vec3::from(new.normal));
        let records = &*self.records;
        let mut least = new.radii[0];
        self.tree.around(position, new.radii[0], |index| {
            if let Some(other) = records.get(index as usize).filter(|other| (self.is_alike)(index, other))
                && let Some(distance) = other.distance_to(position, normal)
            {
                least = least.min(other.radii[0] + distance);
            }
        });
        new.shrink(least);
        self.clamp_around(position, normal, least);
    }

    /// Clamps all records around `position` by a record of `radius` there.
    fn clamp_around(&mut self, position: Vec3, normal: Vec3, radius: f32) {
        let Self { records, is_alike, .. } = self;
        self.tree.at(position, |index| {
            if let Some(other) = records.get_mut(index as usize).filter(|other| is_alike(index, other))
                && let Some(distance) = other.distance_to(position, normal)
            {
                other.shrink(radius + distance);
            }
            true
        });
    }
}

impl Record {
    /// Distance to `position`, if a surface there has a similar normal.
    fn distance_to(&self, position: Vec3, normal: Vec3) -> Option<f32> {
        let alike = normal.dot(Vec3::from(self.normal)) > MIN_NORMAL_COSINE;
        alike.then(|| position.distance(Vec3::from(self.position)))
    }

    /// Curvature, relative to the irradiance, that explains the error of this record at the position of
    /// `other`. Zero without error, or if noise or the radii of both explain it.
    fn contradiction(&self, other: &Record, least_cos: f32) -> f32 {
        let (position, normal) = (Vec3::from(other.position), Vec3::from(other.normal));
        // The boundary of `other` reflects a close overhang.
        let point = QueryPoint { position, normal, within: other.farthest() };
        let Some((extrapolated, _)) = self.at(&point, least_cos) else { return 0.0 };
        let (here, there) = (luminance(self.irradiance.into()), luminance(other.irradiance.into()));
        let square = position.distance_squared(self.position.into());
        // The gradient is noisy as well.
        let noise = there * there * other.noise
            + here
                * here
                * self.noise
                * (1.0 + GRADIENT_VARIANCE * self.mean_square_inverse_distance * square);
        let excess = (there - luminance(extrapolated)).abs() - NOISE_DEVIATIONS * libm::sqrtf(noise);
        let curvature = 2.0 * excess / (square * here.max(there));
        let shrinks = radius(self.allowed, curvature) < self.radii[0].max(other.radii[0]);
        if excess > 0.0 && shrinks { curvature } else { 0.0 }
    }

    /// Raises the error by a curvature that the extrapolation missed.
    fn raise_error(&mut self, curvature: f32) {
        let [r1, r2] = self.radii;
        self.error = self.error.max(curvature * (r1 * r1 + r2 * r2) / 8.0);
    }

    /// Scales the radii by `share`, and the allowed error by its fourth power.
    pub(super) fn scale_radii(&mut self, share: f32) {
        let square = share * share;
        self.allowed *= square * square;
        self.least *= share;
        self.shrink(share * self.radii[0]);
    }

    /// Scales the support so that R1 is at most `radius`.
    fn shrink(&mut self, radius: f32) {
        let [r1, r2] = self.radii;
        if radius < r1 {
            let share = radius / r1;
            // Rounding must not make the longer radius the shorter.
            self.radii = [radius, (r2 * share).max(radius)];
            if radius <= self.least {
                self.overlap = self.overlap.min(1.0);
            }
            // Mean of a square over the ellipse.
            self.error *= share * share;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;

    #[test]
    fn a_circle_that_shrinks_stays_one() {
        let random = Random::new(4, 4);
        for i in 0..1000 {
            let radius = random.single(2 * i);
            let mut circle = Record { radii: [radius; 2], ..Record::default() };
            circle.shrink(radius * random.single(2 * i + 1));
            assert_eq!(circle.radii[0], circle.radii[1]);
        }
    }
}
