//! The results that a batch of rays is traced for: nearest hits, or whether anything occludes.

use crate::geometry::Hit;

/// Use of the hits of a batch of rays. All start as [`Hit::NONE`].
pub(super) trait Sink {
    /// No hit for any of `count` rays from `base` on.
    fn clear(&mut self, base: u32, count: usize);
    /// Takes the hit of a ray, or none. An index beyond the end is harmless.
    fn put(&mut self, index: u32, hit: Hit);
}

/// Keeps the hits.
pub(super) struct Nearest<'a>(pub &'a mut [Hit]);

/// Keeps whether there was one.
pub(super) struct Occluded<'a>(pub &'a mut [u8]);

impl Sink for Nearest<'_> {
    #[inline(always)]
    fn clear(&mut self, base: u32, count: usize) {
        self.0.iter_mut().skip(base as usize).take(count).for_each(|hit| *hit = Hit::NONE);
    }

    #[inline(always)]
    fn put(&mut self, index: u32, hit: Hit) {
        if let Some(slot) = self.0.get_mut(index as usize) {
            *slot = hit;
        }
    }
}

impl Nearest<'_> {
    /// Takes the hits of as many rays from `base` on; whether there is room.
    #[inline(always)]
    pub(super) fn put_all(&mut self, base: u32, hits: &[Hit]) -> bool {
        let from = base as usize;
        let Some(slots) = self.0.get_mut(from..from + hits.len()) else { return false };
        slots.copy_from_slice(hits);
        true
    }
}

impl Sink for Occluded<'_> {
    #[inline(always)]
    fn clear(&mut self, base: u32, count: usize) {
        self.0.iter_mut().skip(base as usize).take(count).for_each(|hidden| *hidden = 0);
    }

    #[inline(always)]
    fn put(&mut self, index: u32, hit: Hit) {
        if let Some(slot) = self.0.get_mut(index as usize) {
            *slot = hit.is_some() as u8;
        }
    }
}
