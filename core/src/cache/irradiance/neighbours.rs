//! Neighbouring records correct each other. If one contradicts the other beyond their noise, the radii of
//! both shrink, and no radius is much larger than that of a neighbour.

use super::lanes::QueryPoint;
use super::record::Record;
use super::validity::radius;
use crate::cache::octree::Octree;
use crate::light::luminance;
use glam::Vec3;

/// Records of surfaces that face the same way to within 60 degrees clamp each other.
const ALIKE: f32 = 0.5;

/// Standard deviations of noise within which records that disagree may both be right.
const EXCUSED: f32 = 3.0;

/// The variance of a gradient over that of the irradiance and the mean of 1/t².
const STEEP: f32 = 16.0;

/// Neighbours that a new record is compared with.
const MOST_COMPARED: usize = 32;

/// The records of a cache, and the tree that finds them.
pub(super) struct Neighbours<'a, 'm> {
    pub(super) records: &'a mut [Record],
    pub(super) tree: &'a Octree<'m>,
    /// Cosine of the greatest deviation of normals.
    pub(super) least_cos: f32,
}

impl Neighbours<'_, '_> {
    /// Compares the extrapolations of a new record and its neighbours. A hemisphere does not show, for
    /// example, a surface that comes into sight a step farther; a neighbour does. If one record contradicts
    /// the other beyond their noise, the difference is taken for a curvature: both radii become those of this
    /// curvature, and the record that was wrong gets less weight.
    pub(super) fn compare(&mut self, new: &mut Record) {
        if new.allowed <= 0.0 {
            return;
        }
        let position = Vec3::from(new.position);
        let mut found = [(0u32, [0.0f32; 2]); MOST_COMPARED];
        let mut count = 0;
        let (records, least_cos) = (&*self.records, self.least_cos);
        // What another says of its place, and what it says of that of another.
        let mut note = |index: u32, curvatures: [f32; 2]| {
            if curvatures != [0.0; 2]
                && let Some(slot) = found.get_mut(count)
            {
                *slot = (index, curvatures);
                count += 1;
            }
            count < MOST_COMPARED
        };
        let this = *new;
        self.tree.at(position, |index| {
            let other = records.get(index as usize);
            note(index, [0.0, other.map_or(0.0, |other| other.misses(&this, least_cos))])
        });
        self.tree.around(position, new.extent().max_element(), |index| {
            let other = records.get(index as usize);
            note(index, [other.map_or(0.0, |other| this.misses(other, least_cos)), 0.0]);
        });
        for &(index, [of_new, of_other]) in found.iter().take(count) {
            let radius = radius(new.allowed, of_new.max(of_other));
            new.learn(of_new);
            new.shrink(radius.max(new.least));
            if let Some(other) = self.records.get_mut(index as usize) {
                other.learn(of_other);
                other.shrink(radius.max(other.least));
                let (position, normal, radius) = (other.position.into(), other.normal.into(), other.radii[0]);
                self.clamp_around(position, normal, radius);
            }
        }
    }

    /// Neighbour clamping (Křivánek et al. 2006, section 4): whatever limits the radius of one record is
    /// farther from the other by their distance, so no radius exceeds that of a neighbour plus the distance
    /// to it. All records that may clamp the new one or be clamped by it are visited.
    pub(super) fn clamp(&mut self, new: &mut Record) {
        let (position, normal) = (Vec3::from(new.position), Vec3::from(new.normal));
        let records = &*self.records;
        let mut least = new.radii[0];
        self.tree.around(position, new.radii[0], |index| {
            if let Some(other) = records.get(index as usize)
                && let Some(distance) = other.distance_to(position, normal)
            {
                least = least.min(other.radii[0] + distance);
            }
        });
        new.shrink(least);
        self.clamp_around(position, normal, least);
    }

    /// Clamps all records by one of that radius.
    fn clamp_around(&mut self, position: Vec3, normal: Vec3, radius: f32) {
        let records = &mut *self.records;
        self.tree.at(position, |index| {
            if let Some(other) = records.get_mut(index as usize)
                && let Some(distance) = other.distance_to(position, normal)
            {
                other.shrink(radius + distance);
            }
            true
        });
    }
}

impl Record {
    /// The distance to a place, where that is on a surface that faces the same way.
    fn distance_to(&self, position: Vec3, normal: Vec3) -> Option<f32> {
        let alike = normal.dot(Vec3::from(self.normal)) > ALIKE;
        alike.then(|| position.distance(Vec3::from(self.position)))
    }

    /// The curvature, relative to the irradiance, that explains the error of this record at the position of
    /// `other`. Zero if there is no error, or if noise or the radii of both explain it.
    fn misses(&self, other: &Record, least_cos: f32) -> f32 {
        let (place, normal) = (Vec3::from(other.position), Vec3::from(other.normal));
        // An overhang close to the other has confined it.
        let point = QueryPoint { position: place, normal, within: other.farthest() };
        let Some((said, _)) = self.at(&point, least_cos) else { return 0.0 };
        let (here, there) = (luminance(self.irradiance.into()), luminance(other.irradiance.into()));
        let square = place.distance_squared(self.position.into());
        // The gradient has noise too.
        let noise =
            there * there * other.noise + here * here * self.noise * (1.0 + STEEP * self.nearness * square);
        let excess = (there - luminance(said)).abs() - EXCUSED * libm::sqrtf(noise);
        let curvature = 2.0 * excess / (square * here.max(there));
        let shrinks = radius(self.allowed, curvature) < self.radii[0].max(other.radii[0]);
        if excess > 0.0 && shrinks { curvature } else { 0.0 }
    }

    /// Takes note of a curvature that its extrapolation missed.
    fn learn(&mut self, curvature: f32) {
        let [r1, r2] = self.radii;
        self.error = self.error.max(curvature * (r1 * r1 + r2 * r2) / 8.0);
    }

    /// Scales the radii, and the error allowed by the fourth power of that.
    pub(super) fn scale_radii(&mut self, share: f32) {
        let square = share * share;
        self.allowed *= square * square;
        self.least *= share;
        self.shrink(share * self.radii[0]);
    }

    /// Makes the support smaller in both directions, so that R1 is not above `radius`.
    fn shrink(&mut self, radius: f32) {
        let [r1, r2] = self.radii;
        if radius < r1 {
            let share = radius / r1;
            // Rounding does not make the longer the shorter.
            self.radii = [radius, (r2 * share).max(radius)];
            if radius <= self.least {
                self.overlap = self.overlap.min(1.0);
            }
            // The mean of a square over the ellipse.
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
