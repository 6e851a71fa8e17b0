//! Sampling of a distant disc, as of the sun, beside the map of its environment.
//!
//! The first coordinate of the unit square that samples the environment is divided: the disc has the part of
//! its power, the map has the rest. Samples of the map within the disc are rejected. Each direction therefore
//! belongs to one point of the square, as visibility tables need it.

use crate::geometry::Frame;
use crate::sampling::{ONE_MINUS_EPSILON, sin_cos_turns};
use crate::scene::DistantDisc;
use core::f32::consts::{PI, TAU};
use glam::{Mat3, Vec3};

/// A disc in the directions of the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct DiscSampler {
    frame: Frame,
    /// Squared length of the chord from the centre to the edge on the unit sphere.
    chord_squared: f32,
    /// Part of the samples, above 0 and below 1.
    share: f32,
}

/// Part of the unit square.
pub(super) enum Part {
    /// The disc, at a point of its own unit square.
    Disc([f32; 2]),
    /// The map, at a point of its own unit square.
    Map([f32; 2]),
}

/// Least part of the samples of the disc and of the map.
const MIN_SHARE: f32 = 1e-3;

impl DiscSampler {
    /// `share` is the part of the disc in the light of the environment.
    pub(super) fn new(disc: &DistantDisc, to_map: Mat3, share: f32) -> Self {
        let frame = Frame::from_normal(to_map * disc.direction);
        let share = if share > 0.0 { share.clamp(MIN_SHARE, 1.0 - MIN_SHARE) } else { MIN_SHARE };
        Self { frame, chord_squared: disc.chord * disc.chord, share }
    }

    /// True if unit direction `d` of the map lies in the disc.
    #[inline]
    pub(super) fn contains(&self, d: Vec3) -> bool {
        d.distance_squared(self.frame.normal) <= self.chord_squared
    }

    /// The part of the unit square at `u`.
    #[inline]
    pub(super) fn part(&self, [u, v]: [f32; 2]) -> Part {
        if u < self.share {
            return Part::Disc([(u / self.share).min(ONE_MINUS_EPSILON), v]);
        }
        let rest = (u - self.share) / (1.0 - self.share);
        Part::Map([rest.clamp(0.0, ONE_MINUS_EPSILON), v])
    }

    /// Unit direction of the map, uniform in the solid angle of the disc.
    #[inline]
    pub(super) fn direction(&self, [u, v]: [f32; 2]) -> Vec3 {
        let height = 0.5 * self.chord_squared * u;
        let radius = libm::sqrtf(height * (2.0 - height));
        let (sin, cos) = sin_cos_turns(v);
        self.frame.to_world(Vec3::new(radius * cos, radius * sin, 1.0 - height))
    }

    /// Density of directions in the disc, in solid angle.
    #[inline]
    pub(super) fn pdf(&self) -> f32 {
        self.share / (PI * self.chord_squared)
    }

    /// Part of the samples that the map has.
    #[inline]
    pub(super) fn share_of_map(&self) -> f32 {
        1.0 - self.share
    }

    /// Point of the unit square whose sample is direction `d` in the disc.
    #[inline]
    pub(super) fn square(&self, d: Vec3) -> [f32; 2] {
        let local = self.frame.to_local(d);
        let u = (d.distance_squared(self.frame.normal) / self.chord_squared).min(1.0);
        let turns = libm::atan2f(local.y, local.x) * (1.0 / TAU);
        [u * self.share, if turns < 0.0 { turns + 1.0 } else { turns }]
    }

    /// Point of the unit square for a point of the square of the map.
    #[inline]
    pub(super) fn square_of_map(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        [self.share + self.share_of_map() * u, v]
    }
}
