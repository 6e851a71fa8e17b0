//! Memory of arenas: counted, checked against the limit, and requested from the system without aborting on
//! failure.

use super::{RenderError, Settings};
use crate::compare::working_bytes;
use crate::memory::{self, Budget};
use crate::pages::Pages;
use core::cell::Cell;
use halflight_core::memory::{Arena, Footprint, Line, MemorySource, OutOfMemory};
use halflight_core::scene::{Scene, Texels};
use std::rc::Rc;

/// Bytes of one structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryUse {
    /// Its name.
    pub structure: &'static str,
    /// Its bytes.
    pub bytes: usize,
}

/// Owner of memory that lives as long as the picture.
pub(super) type Bank = typed_arena::Arena<Vec<Line>>;

/// Bytes in use, and their peak.
pub(super) struct Memory<'m> {
    bank: &'m Bank,
    /// Owner of the memory of [`Memory::within`].
    shorter: Bank,
    /// Requested limit; near it, optional structures are smaller.
    limit: Option<usize>,
    /// Hard limit. Without a requested limit it depends on the machine, and must influence nothing else.
    hard_limit: usize,
    uses: Vec<MemoryUse>,
    /// Peak, also of memory within.
    peak: Rc<Cell<usize>>,
}

impl<'m> Memory<'m> {
    /// Counts as taken: the buffers of `scene`, and the reference with the memory of comparisons.
    pub(super) fn new(scene: &Scene, settings: &Settings, bank: &'m Bank) -> Self {
        let mut memory = Self::of_scene(scene, settings.memory, bank);
        if let Some(reference) = &settings.reference {
            let bytes = size_of_val(&reference.pixels[..]) + working_bytes(reference);
            memory.count("reference", Footprint::default().slice::<u8>(bytes));
        }
        memory
    }

    /// Counts the buffers of `scene` as taken.
    pub(super) fn of_scene(scene: &Scene, limit: Option<usize>, bank: &'m Bank) -> Self {
        let hard_limit = Budget::new(limit).limit();
        let uses = vec![MemoryUse { structure: "scene", bytes: scene_bytes(scene) }];
        let memory = Self { bank, shorter: Bank::new(), limit, hard_limit, uses, peak: Rc::default() };
        memory.peak.set(memory.total());
        memory
    }

    /// Raises the peak to at least `bytes`.
    pub(super) fn raise_peak(&self, bytes: usize) {
        self.peak.set(self.peak.get().max(bytes));
    }

    /// Bytes available for reading a file.
    pub(super) fn for_file(&self) -> usize {
        self.hard_limit.saturating_sub(self.total())
    }

    /// Takes `footprint` bytes for `structure`.
    pub(super) fn take(
        &mut self,
        structure: &'static str,
        footprint: Footprint,
    ) -> Result<Vec<Line>, RenderError> {
        Ok(self.lines(structure, footprint)?)
    }

    fn lines(&mut self, structure: &'static str, footprint: Footprint) -> Result<Vec<Line>, OutOfMemory> {
        let needed = self.needed(footprint)?;
        let lines = memory::lines(footprint).map_err(|_| self.refusal(needed))?;
        self.count(structure, footprint);
        Ok(lines)
    }

    /// Counts `footprint` bytes of `structure` that are allocated elsewhere.
    pub(super) fn set_aside(
        &mut self,
        structure: &'static str,
        footprint: Footprint,
    ) -> Result<(), RenderError> {
        self.needed(footprint)?;
        self.count(structure, footprint);
        Ok(())
    }

    /// As [`Self::take`], for memory read in random order.
    pub(super) fn take_pages(
        &mut self,
        structure: &'static str,
        footprint: Footprint,
    ) -> Result<Pages, RenderError> {
        let needed = self.needed(footprint)?;
        let pages = Pages::new(footprint).map_err(|_| self.refusal(needed))?;
        self.count(structure, footprint);
        Ok(pages)
    }

    /// Bytes in use after `footprint` more; an error beyond the hard limit.
    fn needed(&self, footprint: Footprint) -> Result<usize, OutOfMemory> {
        let needed = self.total().saturating_add(footprint.bytes());
        match needed > self.hard_limit {
            true => Err(OutOfMemory { needed, available: self.hard_limit }),
            false => Ok(needed),
        }
    }

    /// Error of a system that refuses memory: the bytes that it has given are all that are available.
    fn refusal(&self, needed: usize) -> OutOfMemory {
        OutOfMemory { needed, available: self.total() }
    }

    fn count(&mut self, structure: &'static str, footprint: Footprint) {
        let bytes = footprint.bytes();
        match self.uses.iter_mut().find(|other| other.structure == structure) {
            Some(other) => other.bytes += bytes,
            None => self.uses.push(MemoryUse { structure, bytes }),
        }
        self.raise_peak(self.total());
    }

    /// Takes `footprint` bytes `count` times: working memory of each thread.
    pub(super) fn take_each(
        &mut self,
        structure: &'static str,
        footprint: Footprint,
        count: usize,
    ) -> Result<Vec<Vec<Line>>, RenderError> {
        (0..count).map(|_| self.take(structure, footprint)).collect()
    }

    /// Bytes left below the limit; unlimited without one.
    pub(super) fn available(&self) -> usize {
        self.limit.map_or(usize::MAX, |limit| limit.saturating_sub(self.total()))
    }

    /// True if `bytes` more stay within the limit.
    pub(super) fn has(&self, bytes: usize) -> bool {
        self.limit.is_none_or(|limit| self.total().saturating_add(bytes) <= limit)
    }

    /// Frees the count of `structure`.
    pub(super) fn give_back(&mut self, structure: &'static str) {
        self.uses.retain(|other| other.structure != structure);
    }

    /// Peak of the bytes in use.
    pub(super) fn peak(&self) -> usize {
        self.peak.get()
    }

    /// Bytes of each structure.
    pub(super) fn uses(&self) -> Vec<MemoryUse> {
        self.uses.clone()
    }

    fn total(&self) -> usize {
        self.uses.iter().fold(0, |sum, other| sum.saturating_add(other.bytes))
    }
}

impl<'m> MemorySource<'m> for Memory<'m> {
    type Within<'s>
        = Memory<'s>
    where
        'm: 's;

    fn within(&mut self) -> Memory<'_> {
        self.shorter = Bank::new();
        let Self { shorter, limit, hard_limit, uses, peak, .. } = self;
        let (uses, peak) = (uses.clone(), peak.clone());
        Memory { bank: shorter, shorter: Bank::new(), limit: *limit, hard_limit: *hard_limit, uses, peak }
    }

    fn available(&self) -> usize {
        Memory::available(self)
    }

    fn take(&mut self, structure: &'static str, footprint: Footprint) -> Result<Arena<'m>, OutOfMemory> {
        let lines = self.bank.alloc(self.lines(structure, footprint)?);
        Ok(Arena::over(lines))
    }

    fn lend<T>(
        &mut self,
        structure: &'static str,
        footprint: Footprint,
        work: impl FnOnce(&mut Self, &mut Arena) -> Result<T, OutOfMemory>,
    ) -> Result<T, OutOfMemory> {
        let mut lines = self.lines(structure, footprint)?;
        let done = work(self, &mut Arena::over(&mut lines));
        if let Some(other) = self.uses.iter_mut().find(|other| other.structure == structure) {
            other.bytes = other.bytes.saturating_sub(footprint.bytes());
        }
        self.uses.retain(|other| other.bytes > 0);
        done
    }
}

/// Bytes of the buffers of a scene.
pub(crate) fn scene_bytes(scene: &Scene) -> usize {
    let (mesh, instances) = (&scene.mesh, &scene.mesh.instances);
    let textures = scene.textures.iter().map(|texture| match texture.texels {
        Texels::Srgb8(texels) | Texels::Linear8(texels) => size_of_val(texels),
        Texels::Float(texels) => size_of_val(texels),
        Texels::Number(texels) => size_of_val(texels),
    });
    size_of_val(mesh.positions)
        + size_of_val(mesh.normals)
        + size_of_val(mesh.texcoords)
        + size_of_val(mesh.second_texcoords)
        + size_of_val(mesh.colors)
        + size_of_val(mesh.triangles)
        + size_of_val(instances.positions)
        + size_of_val(instances.normals)
        + size_of_val(instances.texcoords)
        + size_of_val(instances.second_texcoords)
        + size_of_val(instances.colors)
        + size_of_val(instances.triangles)
        + size_of_val(instances.overlaps)
        + size_of_val(instances.prototypes)
        + size_of_val(instances.placed)
        + size_of_val(scene.materials)
        + size_of_val(scene.lights)
        + textures.sum::<usize>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory(bank: &Bank, limit: usize) -> Memory<'_> {
        let (shorter, uses, peak) = (Bank::new(), Vec::new(), Rc::default());
        Memory { bank, shorter, limit: Some(limit), hard_limit: limit, uses, peak }
    }

    #[test]
    fn an_error_compares_all_bytes_needed_with_the_limit_or_with_the_bytes_that_the_system_gave() {
        let (bank, bytes) = (Bank::new(), |bytes| Footprint::default().slice::<u8>(bytes));
        let mut memory = memory(&bank, 1 << 62);
        memory.take("film", bytes(1 << 20)).unwrap();
        let beyond = RenderError::Memory { needed: (1 << 20) + (1 << 62), available: 1 << 62 };
        assert_eq!(memory.take("lights", bytes(1 << 62)).err(), Some(beyond));
        let refused = RenderError::Memory { needed: (1 << 20) + (1 << 61), available: 1 << 20 };
        assert_eq!(memory.take("lights", bytes(1 << 61)).err().as_ref(), Some(&refused));
        assert_eq!(memory.take_pages("bvh", bytes(1 << 61)).err().as_ref(), Some(&refused));
        assert_eq!((memory.total(), memory.peak()), (1 << 20, 1 << 20));
    }

    #[test]
    fn memory_of_a_shorter_life_is_in_the_peak_alone() {
        let (bank, bytes) = (Bank::new(), |bytes| Footprint::default().slice::<u8>(bytes));
        let mut memory = memory(&bank, 1 << 30);
        memory.take("film", bytes(64)).unwrap();
        let mut other = memory.within();
        other.take("photons", bytes(128)).unwrap();
        assert_eq!(other.available(), (1 << 30) - 192);
        drop(other);
        assert_eq!((memory.available(), memory.peak()), ((1 << 30) - 64, 192));
    }
}
