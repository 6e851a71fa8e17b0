//! Memory in huge pages, for data that rays read in random order: with small pages half of the reads miss the
//! page table as well as the cache.

use core::ops::{Deref, DerefMut};
use halflight_core::memory::{Footprint, Line, OutOfMemory};
use memmap2::MmapMut;

/// Zeroed cache lines, mapped from the system.
#[derive(Debug, Default)]
pub struct Pages(Option<MmapMut>);

impl Pages {
    /// Lines of `footprint` bytes.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the system refuses.
    pub fn new(footprint: Footprint) -> Result<Self, OutOfMemory> {
        let needed = footprint.bytes();
        if needed == 0 {
            return Ok(Self(None));
        }
        let bytes = needed.checked_next_multiple_of(size_of::<Line>());
        let map = bytes.and_then(|bytes| MmapMut::map_anon(bytes).ok());
        let map = map.ok_or(OutOfMemory { needed, available: 0 })?;
        // Advice only: a system without huge pages gives small ones.
        #[cfg(target_os = "linux")]
        let _ = map.advise(memmap2::Advice::HugePage);
        Ok(Self(Some(map)))
    }
}

impl Deref for Pages {
    type Target = [Line];

    fn deref(&self) -> &[Line] {
        self.0.as_deref().map_or(&[], bytemuck::cast_slice)
    }
}

impl DerefMut for Pages {
    fn deref_mut(&mut self) -> &mut [Line] {
        self.0.as_deref_mut().map_or(&mut [], bytemuck::cast_slice_mut)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn footprint_in_zeroed_lines() {
        for bytes in [0, 1, 64, 65, 5 << 20] {
            let mut pages = Pages::new(Footprint::default().slice::<u8>(bytes)).expect("there is memory");
            assert_eq!(pages.len(), Footprint::default().slice::<u8>(bytes).bytes().div_ceil(64));
            assert!(pages.iter().all(|line| line.0 == [0; 64]));
            pages.iter_mut().for_each(|line| line.0[63] = 7);
        }
        assert!(Pages::new(Footprint::default().slice::<u8>(1 << 62)).is_err());
    }
}
