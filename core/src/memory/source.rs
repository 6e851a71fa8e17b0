//! Memory source of a method: the caller's memory in pieces of sizes that depend on the scene.

use super::{Arena, Footprint, OutOfMemory};

/// A supply of memory that lives as long as the picture. Each piece has a name for reports.
pub trait MemorySource<'m> {
    /// The supply of [`MemorySource::within`].
    type Within<'s>: MemorySource<'s>
    where
        Self: 's;

    /// Bytes that may still be taken, which limit structures of variable size. `usize::MAX` without a limit.
    fn available(&self) -> usize;

    /// Memory of `footprint` bytes.
    ///
    /// # Errors
    /// [`OutOfMemory`] if less is left.
    fn take(&mut self, structure: &'static str, footprint: Footprint) -> Result<Arena<'m>, OutOfMemory>;

    /// Runs `work` with memory of `footprint` bytes that is free again afterwards.
    ///
    /// # Errors
    /// [`OutOfMemory`] if less is left; the errors of `work`.
    fn lend<T>(
        &mut self,
        structure: &'static str,
        footprint: Footprint,
        work: impl FnOnce(&mut Self, &mut Arena) -> Result<T, OutOfMemory>,
    ) -> Result<T, OutOfMemory>;

    /// The memory that is left, as a supply for structures of a shorter life. It is free again after them.
    fn within(&mut self) -> Self::Within<'_>;

    /// True if `footprint` bytes may still be taken.
    fn has(&self, footprint: Footprint) -> bool {
        footprint.bytes() <= self.available()
    }
}

/// Largest number of free pieces of a buffer.
const PIECES: usize = 8;

/// A source over one buffer, such as a `static` of a microcontroller.
pub struct Buffer<'m> {
    free: [&'m mut [u8]; PIECES],
}

impl<'m> Buffer<'m> {
    /// Buffer whose `bytes` are all free.
    pub fn new(bytes: &'m mut [u8]) -> Self {
        let mut free: [&'m mut [u8]; PIECES] = Default::default();
        free[0] = bytes;
        Self { free }
    }

    /// Cuts `footprint` bytes off the smallest free piece that is large enough.
    fn cut(&mut self, footprint: Footprint) -> Result<&'m mut [u8], OutOfMemory> {
        let available = self.available();
        let aligned = |piece: &[u8]| piece.as_ptr().align_offset(super::ALIGNMENT).min(piece.len());
        let needed = footprint.bytes();
        let fits = |piece: &&mut &'m mut [u8]| piece.len() - aligned(piece) >= needed;
        let piece = self.free.iter_mut().filter(fits).min_by_key(|piece| piece.len());
        let Some(piece) = piece else { return Err(OutOfMemory { needed, available }) };
        let bytes = core::mem::take(piece);
        let skip = aligned(bytes);
        let (cut, rest) = bytes[skip..].split_at_mut(needed);
        *piece = rest;
        Ok(cut)
    }
}

impl<'m> MemorySource<'m> for Buffer<'m> {
    type Within<'s>
        = Buffer<'s>
    where
        'm: 's;

    fn within(&mut self) -> Buffer<'_> {
        Buffer::new(
            self.free.iter_mut().max_by_key(|piece| piece.len()).map_or(&mut [], |piece| &mut **piece),
        )
    }

    fn available(&self) -> usize {
        let aligned = |piece: &[u8]| piece.as_ptr().align_offset(super::ALIGNMENT).min(piece.len());
        self.free.iter().map(|piece| piece.len() - aligned(piece)).max().unwrap_or(0)
    }

    fn take(&mut self, _: &'static str, footprint: Footprint) -> Result<Arena<'m>, OutOfMemory> {
        Ok(Arena::new(self.cut(footprint)?))
    }

    fn lend<T>(
        &mut self,
        _: &'static str,
        footprint: Footprint,
        work: impl FnOnce(&mut Self, &mut Arena) -> Result<T, OutOfMemory>,
    ) -> Result<T, OutOfMemory> {
        let bytes = self.cut(footprint)?;
        let done = work(self, &mut Arena::new(bytes));
        // An empty piece takes the bytes back. Without one they stay unused.
        if let Some(piece) = self.free.iter_mut().find(|piece| piece.is_empty()) {
            *piece = bytes;
        }
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Line;

    #[test]
    fn lent_memory_is_free_again_and_taken_memory_is_not() {
        let mut lines = [Line([0; 64]); 4];
        let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut lines));
        let line = Footprint::default().slice::<u32>(16);
        let kept = buffer.lend("scratch", line.and(line), |buffer, arena| {
            assert_eq!((buffer.available(), arena.available()), (128, 128));
            assert!(!buffer.has(line.and(line).and(line)));
            buffer.take("kept", line)
        });
        assert!(kept.is_ok_and(|arena| arena.available() == 64));
        assert!(buffer.take("more", line.and(line)).is_ok());
        assert!(buffer.take("last", line).is_ok() && buffer.take("none", line).is_err());
    }
}
