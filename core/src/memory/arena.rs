//! Arena (bump allocator) over bytes of the caller. It hands out typed slices and never frees: the owner of
//! the bytes decides how long their contents live.

use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};
use core::fmt;

/// Alignment in bytes of every slice: a cache line, and an AVX-512 register.
pub const ALIGNMENT: usize = 64;

/// One aligned cache line. An [`Arena`] wastes no byte of an array or `Vec` of lines.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Line(pub [u8; ALIGNMENT]);

impl Line {
    /// A line of zeros.
    pub const ZERO: Self = Self([0; ALIGNMENT]);

    /// Number of lines that hold `bytes`.
    ///
    /// ```
    /// use halflight_core::Line;
    /// static MEMORY: [Line; Line::count(65)] = [Line::ZERO; Line::count(65)];
    /// assert_eq!(MEMORY.len(), 2);
    /// ```
    pub const fn count(bytes: usize) -> usize {
        bytes.div_ceil(ALIGNMENT)
    }
}

/// Error of an arena that is too small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfMemory {
    /// Bytes that the structure needs, including padding; `usize::MAX` if the number overflows.
    pub needed: usize,
    /// Bytes left in the arena.
    pub available: usize,
}

impl fmt::Display for OutOfMemory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "out of memory: {} bytes needed, {} available", self.needed, self.available)
    }
}

impl core::error::Error for OutOfMemory {}

/// Arena (bump allocator) over borrowed bytes.
///
/// ```
/// use halflight_core::memory::{Arena, Line};
/// let mut lines = [Line([0; 64]); 4];
/// let mut arena = Arena::over(&mut lines);
/// let numbers: &mut [u32] = arena.slice(16)?;
/// assert_eq!((numbers.len(), arena.available()), (16, 192));
/// # Ok::<(), halflight_core::memory::OutOfMemory>(())
/// ```
pub struct Arena<'m> {
    rest: &'m mut [u8],
}

impl<'m> Arena<'m> {
    /// Arena over the whole lines of `bytes`. Bytes before the first multiple of [`ALIGNMENT`] and behind the
    /// last stay unused. A [`Footprint`](super::Footprint) is therefore exact for memory made of [`Line`]s.
    pub fn new(bytes: &'m mut [u8]) -> Self {
        let skip = bytes.as_ptr().align_offset(ALIGNMENT).min(bytes.len());
        let whole = (bytes.len() - skip) / ALIGNMENT * ALIGNMENT;
        Self { rest: &mut bytes[skip..skip + whole] }
    }

    /// Arena over `lines`, of which it wastes no byte.
    pub fn over(lines: &'m mut [Line]) -> Self {
        Self::new(bytemuck::cast_slice_mut(lines))
    }

    /// Bytes not handed out yet.
    pub fn available(&self) -> usize {
        self.rest.len()
    }

    /// Slice of `count` values, zero or left over from an earlier use of the bytes, for the caller to
    /// overwrite. Takes `size_of::<T>() * count` bytes rounded up to [`ALIGNMENT`].
    ///
    /// # Errors
    /// [`OutOfMemory`] when that is more than is left; the arena is unchanged.
    pub fn slice<T: NoUninit + AnyBitPattern>(&mut self, count: usize) -> Result<&'m mut [T], OutOfMemory> {
        let available = self.rest.len();
        let failed = |needed| OutOfMemory { needed, available };
        let padded = padded_bytes::<T>(count).ok_or(failed(usize::MAX))?;
        let rest = core::mem::take(&mut self.rest);
        if padded > available {
            self.rest = rest;
            return Err(failed(padded));
        }
        let (taken, rest) = rest.split_at_mut(padded);
        self.rest = rest;
        bytemuck::try_cast_slice_mut(&mut taken[..count * size_of::<T>()]).map_err(|_| failed(padded))
    }

    /// Lends the unused bytes as a second arena, for working memory of a build. Its contents are lost when
    /// the loan ends.
    pub fn scratch(&mut self) -> Arena<'_> {
        Arena { rest: self.rest }
    }
}

/// Bytes of `count` values of `T`, rounded up to [`ALIGNMENT`]; `None` on overflow.
pub(super) const fn padded_bytes<T>(count: usize) -> Option<usize> {
    match count.checked_mul(size_of::<T>()) {
        Some(bytes) => bytes.checked_next_multiple_of(ALIGNMENT),
        None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_bytes_suffice_and_one_less_is_an_error() {
        let mut lines = [Line([0; 64]); 3];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut lines);
        assert_eq!(Arena::new(bytes).slice::<u32>(48).map(|s| s.len()), Ok(48));
        let short = Arena::new(&mut bytes[..191]).slice::<u32>(48).map(|s| s.len());
        assert_eq!(short, Err(OutOfMemory { needed: 192, available: 128 }));
    }

    #[test]
    fn all_that_is_available_can_be_taken_from_bytes_of_any_place_and_length() {
        let mut lines = [Line([0; 64]); 4];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut lines);
        for (first, end, available) in [(0, 256, 256), (1, 256, 192), (16, 240, 128), (1, 63, 0), (0, 0, 0)] {
            let mut arena = Arena::new(&mut bytes[first..end]);
            assert_eq!(arena.available(), available);
            assert_eq!(arena.slice::<u8>(available).map(|taken| taken.len()), Ok(available));
        }
    }

    #[test]
    fn a_failed_request_takes_nothing() {
        let mut lines = [Line([0; 64]); 2];
        let mut arena = Arena::over(&mut lines);
        assert!(arena.slice::<u64>(usize::MAX).is_err());
        assert!(arena.slice::<u8>(129).is_err());
        assert_eq!(arena.available(), 128);
    }

    #[test]
    fn unaligned_bytes_are_skipped() {
        let mut lines = [Line([0; 64]); 2];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut lines);
        assert_eq!(Arena::new(&mut bytes[1..]).available(), 64);
        assert_eq!(Arena::new(&mut bytes[..0]).available(), 0);
    }
}
