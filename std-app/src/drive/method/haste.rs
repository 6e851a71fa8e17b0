//! Caches in a hurry: where a picture has a limit of time, filling them has a share of it, and what no record reaches by then
//! is path traced. The overture goes from coarse to fine, so that a part of it serves most of the picture.

use core::time::Duration;
use std::time::Instant;

/// The share of the time of a picture that is there for both of its caches.
const SHARE: f64 = 0.5;

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
        let seconds = 0.5 * SHARE * self.seconds * (half as f64 + 1.0);
        self.start.checked_add(Duration::try_from_secs_f64(seconds.max(0.0)).ok()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caches_have_half_of_the_time() {
        let haste = Haste::new(8.0);
        let after = |at: Option<Instant>| at.unwrap().duration_since(haste.start).as_secs_f64();
        assert_eq!([haste.end(0), haste.end(1)].map(after), [2.0, 4.0]);
        // However long or short.
        assert_eq!(Haste::new(1e300).end(0), None);
        let none = Haste::new(0.0);
        assert_eq!(none.end(1), Some(none.start));
    }
}
