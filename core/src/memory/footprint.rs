//! Footprint of a structure in bytes of an arena, computed before it is built, slice by slice.

use super::arena::padded_bytes;

/// A count of arena bytes. Saturates at `usize::MAX`, which no arena can grant.
///
/// ```
/// use halflight_core::memory::Footprint;
/// let two = Footprint::default().slice::<u32>(17).slice::<u8>(1);
/// assert_eq!(two.bytes(), 128 + 64);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[must_use]
pub struct Footprint {
    bytes: usize,
}

impl Footprint {
    /// Adds a slice of `count` values of `T`, as [`Arena::slice`](super::Arena::slice) takes it.
    pub const fn slice<T>(self, count: usize) -> Self {
        let more = match padded_bytes::<T>(count) {
            Some(bytes) => bytes,
            None => usize::MAX,
        };
        Self { bytes: self.bytes.saturating_add(more) }
    }

    /// Sum of two structures that live at the same time.
    pub const fn and(self, other: Footprint) -> Self {
        Self { bytes: self.bytes.saturating_add(other.bytes) }
    }

    /// Maximum of two structures, for working memory used in turn.
    pub const fn or(self, other: Footprint) -> Self {
        if self.bytes > other.bytes { self } else { other }
    }

    /// Bytes, for an arena that starts at a multiple of [`ALIGNMENT`](super::ALIGNMENT).
    pub const fn bytes(self) -> usize {
        self.bytes
    }
}
