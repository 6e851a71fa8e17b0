//! Caches in a hurry: where a picture has a limit of time, filling them has a share of it, and what no record reaches by then
//! is path traced. The overture goes from coarse to fine, so that a part of it serves most of the picture; where it would
//! not, records have fewer rays each.

use core::time::Duration;
use std::time::Instant;

/// The share of the time of a picture that is there for both of its caches.
const SHARE: f64 = 0.5;

/// The part of the time of the first cache after which it is looked whether records will reach far enough: most of what they
/// reach they reach early.
const GLANCE: f64 = 0.25;

/// They will where they serve this share of what the camera sees. Records of fewer rays are noisier than a picture with gaps
/// between better ones.
pub(super) const ENOUGH: f64 = 0.25;

/// When caches must be filled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Haste {
    start: Instant,
    seconds: f64,
}

impl Haste {
    /// For a picture that has so many `seconds`, from now on.
    pub(super) fn new(seconds: f64) -> Self {
        Self { start: Instant::now(), seconds }
    }

    /// When the cache of that half of the film must be filled; `None` is later than any clock can tell.
    pub(super) fn end(&self, half: usize) -> Option<Instant> {
        self.at(half as f64 + 1.0)
    }

    /// When it is looked how far the first is.
    pub(super) fn glance(&self) -> Option<Instant> {
        self.at(GLANCE)
    }

    /// Seconds that the picture has left.
    pub(super) fn left(&self) -> f64 {
        (self.seconds - self.start.elapsed().as_secs_f64()).max(0.0)
    }

    /// After so many times the time of one.
    fn at(&self, caches: f64) -> Option<Instant> {
        let later = Duration::try_from_secs_f64((0.5 * SHARE * self.seconds * caches).max(0.0)).ok()?;
        self.start.checked_add(later)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caches_have_half_of_the_time() {
        let haste = Haste::new(8.0);
        let after = |at: Option<Instant>| at.unwrap().duration_since(haste.start).as_secs_f64();
        let all = [haste.glance(), haste.end(0), haste.end(1)].map(after);
        assert_eq!(all, [0.5, 2.0, 4.0]);
        // However long or short.
        assert_eq!(Haste::new(1e300).end(0), None);
        let none = Haste::new(0.0);
        assert_eq!(none.end(1), Some(none.start));
    }
}
