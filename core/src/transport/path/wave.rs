//! Working memory of the path tracer: a wavefront, and beside it the state of an estimator and of sharing.

use super::sharing::Sharing;
use crate::Rgb;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::wavefront::Wavefront;
use bytemuck::{Pod, Zeroable};

/// A wavefront, with an estimator's state `S` of each path and the working memory of sharing.
pub struct PathWave<'m, S, R: Sharing> {
    pub(in crate::transport) wave: Wavefront<'m>,
    pub(in crate::transport) memory: PathMemory<'m, S, R>,
}

/// The part of the memory that the wavefront does not know. Slices are empty where there is no state.
pub(in crate::transport) struct PathMemory<'m, S, R: Sharing> {
    pub(in crate::transport) states: &'m mut [S],
    pub(in crate::transport) shared: &'m mut [R::State],
    pub(in crate::transport) pairs: &'m mut [R::Pair],
}

impl<'m, S: Pod, R: Sharing> PathWave<'m, S, R> {
    /// Bytes that [`PathWave::new`] takes.
    pub(in crate::transport) fn footprint(capacity: usize) -> Footprint {
        let paths = Wavefront::capacity(capacity);
        Wavefront::footprint(capacity).slice::<S>(paths).slice::<R::State>(paths).slice::<R::Pair>(paths)
    }

    /// An empty wave of `capacity` paths.
    pub(in crate::transport) fn new(capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let paths = Wavefront::capacity(capacity);
        let wave = Wavefront::new(capacity, arena)?;
        let (states, shared) = (slice(paths, arena)?, slice(paths, arena)?);
        Ok(Self { wave, memory: PathMemory { states, shared, pairs: slice(paths, arena)? } })
    }

    /// Radiance of the sample of path number `path`.
    #[inline]
    pub(in crate::transport) fn radiance(&self, path: usize) -> Rgb {
        let none = R::State::zeroed();
        R::radiance(self.memory.shared.get(path).unwrap_or(&none), &self.wave.paths[path])
    }

    /// Resets what is beside the wavefront for path number `path`, of this circle.
    #[inline]
    pub(in crate::transport) fn begin(&mut self, path: usize, circle: u32) {
        let PathMemory { states, shared, .. } = &mut self.memory;
        if let Some(state) = states.get_mut(path) {
            *state = S::zeroed();
        }
        if let Some(state) = shared.get_mut(path) {
            *state = R::begin(circle);
        }
    }
}

/// A slice of `count` values; an empty one of values without size.
fn slice<'m, T: Pod>(count: usize, arena: &mut Arena<'m>) -> Result<&'m mut [T], OutOfMemory> {
    if size_of::<T>() == 0 { Ok(&mut []) } else { arena.slice(count) }
}
