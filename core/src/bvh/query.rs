//! Results of a batch of rays: nearest hits, or occlusion.

use crate::geometry::Hit;

/// Receiver of the hits of a batch of rays. All start as [`Hit::NONE`].
pub(super) trait Sink {
    /// Resets `count` rays from `base` on to no hit.
    fn clear(&mut self, base: u32, count: usize);
    /// Takes the hit of a ray, or none. An index beyond the end is ignored.
    fn put(&mut self, index: u32, hit: Hit);
}

/// Stores the hits.
pub(super) struct Nearest<'a>(pub &'a mut [Hit]);

/// Stores 1 for a hit, else 0.
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
    /// Takes the hits of consecutive rays from `base` on; `false` if they do not fit.
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
