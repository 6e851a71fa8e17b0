//! Photon maps in memory of the caller: filled in one pass, built in place, and made anew in the same bytes
//! for later samples.

use super::executor::{Executor, Passed};
use crate::bsdf::Features;
use crate::bvh::ForkJoin;
use crate::memory::{Arena, Footprint, MemorySource, OutOfMemory};
use crate::photon::{MapShape, Photon, PhotonMap, Photons};
use crate::transport::Counters;
use crate::transport::photon_mapping::deposit::PhotonTracer;

/// Memory for one photon map, and the map in it.
pub struct PhotonMapStore<'m> {
    arena: Arena<'m>,
    /// Photons that the map had room for, and its shape; `None` before the first map.
    built: Option<(usize, MapShape)>,
}

impl<'m> PhotonMapStore<'m> {
    /// Bytes of a store for `capacity` photons.
    pub fn footprint(capacity: usize) -> Footprint {
        Photons::footprint(capacity)
    }

    /// Memory for `capacity` photons, reported as "photons".
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` has less than [`PhotonMapStore::footprint`] bytes.
    pub fn new(capacity: usize, memory: &mut impl MemorySource<'m>) -> Result<Self, OutOfMemory> {
        Ok(Self::over(memory.take("photons", Self::footprint(capacity))?))
    }

    /// Memory for as many photons as `arena` has bytes for.
    pub fn over(arena: Arena<'m>) -> Self {
        Self { arena, built: None }
    }

    /// Makes a map of `count` photons: `write` fills each `piece` of them, by number. The map is there if the
    /// pass is complete; the one before is gone.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the store has less than [`PhotonMapStore::footprint`] bytes; those of `write`.
    pub fn fill<E: Executor>(
        &mut self,
        executor: &mut E,
        (count, piece): (usize, usize),
        write: impl Fn(usize, &mut Arena, &mut [Photon]) -> Result<Counters, OutOfMemory> + Sync,
    ) -> Result<Passed, OutOfMemory> {
        self.built = None;
        let mut photons = Photons::new(count, &mut self.arena.scratch())?;
        let pieces = photons.as_mut_slice().chunks_mut(piece.max(1));
        let mut passed =
            executor.pass(pieces, |number, photons, worker| write(number, &mut worker.scratch, photons))?;
        if passed.is_complete {
            let fork = executor.fork();
            let shape = photons.build_with(count, fork).shape();
            passed.is_complete = !fork.is_over();
            self.built = passed.is_complete.then_some((count, shape));
        }
        Ok(passed)
    }

    /// Makes the map of the photons that `tracer` traces for map number `map`. Its time is that of "photons".
    ///
    /// # Errors
    /// Those of [`PhotonMapStore::fill`].
    pub fn trace<F: Features>(
        &mut self,
        executor: &mut impl Executor,
        tracer: &PhotonTracer<F>,
        map: u32,
    ) -> Result<Passed, OutOfMemory> {
        let size = (tracer.tasks().saturating_mul(tracer.room()), tracer.room());
        executor.timed("photons", |executor| {
            self.fill(executor, size, |task, scratch, photons| tracer.run(task, map, scratch, photons))
        })
    }

    /// The last map, unless there is none.
    ///
    /// # Errors
    /// None: a map that was built fits.
    pub fn map(&mut self) -> Result<Option<PhotonMap<'_>>, OutOfMemory> {
        let Self { arena, built } = self;
        built
            .as_ref()
            .map(|(count, shape)| PhotonMap::from_shape(shape, *count, &mut arena.scratch()))
            .transpose()
    }
}

/// Maps of the even and of the odd samples, which have nothing in common: the halves of the film stay
/// independent.
pub struct PhotonMapPair<'m> {
    /// Map of even samples.
    pub even: PhotonMapStore<'m>,
    /// Map of odd samples.
    pub odd: PhotonMapStore<'m>,
}

impl<'m> PhotonMapPair<'m> {
    /// Memory for `capacity` photons in each map, reported as "photons".
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` has less than twice [`PhotonMapStore::footprint`] bytes.
    pub fn new(capacity: usize, memory: &mut impl MemorySource<'m>) -> Result<Self, OutOfMemory> {
        Ok(Self { even: PhotonMapStore::new(capacity, memory)?, odd: PhotonMapStore::new(capacity, memory)? })
    }

    /// The last maps of even and odd samples, unless one is missing.
    ///
    /// # Errors
    /// Those of [`PhotonMapStore::map`].
    pub fn maps(&mut self) -> Result<Option<[PhotonMap<'_>; 2]>, OutOfMemory> {
        let Self { even, odd } = self;
        Ok(even.map()?.zip(odd.map()?).map(|(even, odd)| [even, odd]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::memory::{Buffer, Line};
    use crate::method::Loop;
    use core::cell::Cell;
    use glam::Vec3;
    use std::vec;

    const COUNT: usize = 1000;
    const PIECE: usize = 300;

    /// Photons on a line, `map` apart, the last of each piece without a place.
    fn write(map: u32) -> impl Fn(usize, &mut Arena, &mut [Photon]) -> Result<Counters, OutOfMemory> + Sync {
        move |number, _, photons| {
            for (i, photon) in photons.iter_mut().enumerate() {
                let place = Vec3::X * (number * PIECE + i) as f32 * map as f32;
                *photon = Photon::new(place, Vec3::Z, Vec3::Z, Rgb::ONE);
            }
            photons[photons.len() - 1] = Photon::NONE;
            Ok(Counters { rays: photons.len() as u64, ..Counters::default() })
        }
    }

    #[test]
    fn maps_are_made_anew_in_the_same_bytes() {
        let mut lines = vec![Line([0; 64]); PhotonMapStore::footprint(COUNT).bytes() / 64];
        let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut lines));
        let mut store = PhotonMapStore::new(COUNT, &mut buffer).unwrap();
        let mut executor = Loop::new(&mut []);
        assert!(store.map().unwrap().is_none());
        for (map, count) in [(1, COUNT), (2, 301), (3, COUNT)] {
            let passed = store.fill(&mut executor, (count, PIECE), write(map)).unwrap();
            assert_eq!((passed.is_complete, passed.counters.rays), (true, count as u64));
            let built = store.map().unwrap().unwrap();
            assert_eq!(built.refused(), count.div_ceil(PIECE));
            let extent = (0..built.len() as u32).map(|i| built.get(i).unwrap().position().x);
            let expected = if count == COUNT { 998 } else { 298 } * map;
            assert_eq!(extent.fold(0.0, f32::max), expected as f32);
        }
    }

    #[test]
    fn a_map_whose_pass_ends_early_is_not_there() {
        let mut lines = vec![Line([0; 64]); 2 * PhotonMapStore::footprint(COUNT).bytes() / 64];
        let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut lines));
        let mut pair = PhotonMapPair::new(COUNT, &mut buffer).unwrap();
        for store in [&mut pair.even, &mut pair.odd] {
            assert!(store.fill(&mut Loop::new(&mut []), (COUNT, PIECE), write(1)).unwrap().is_complete);
        }
        assert!(pair.maps().unwrap().is_some());
        let left = Cell::new(2);
        let is_over = || left.replace(left.get() - 1) <= 0;
        let passed = pair.odd.fill(&mut Loop::new(&mut []).until(&is_over), (COUNT, PIECE), write(2));
        assert!(!passed.unwrap().is_complete && pair.odd.map().unwrap().is_none());
        assert!(pair.maps().unwrap().is_none() && pair.even.map().unwrap().is_some());
    }

    #[test]
    fn too_little_memory_is_an_error() {
        let mut lines = vec![Line([0; 64]); PhotonMapStore::footprint(COUNT).bytes() / 64];
        let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut lines));
        assert!(PhotonMapStore::new(COUNT + 100, &mut buffer).is_err());
        let mut store = PhotonMapStore::new(COUNT, &mut buffer).unwrap();
        assert!(store.fill(&mut Loop::new(&mut []), (COUNT + 100, PIECE), write(1)).is_err());
        let short = OutOfMemory { needed: 2, available: 1 };
        let passed = store.fill(&mut Loop::new(&mut []), (COUNT, PIECE), |_, _, _| Err(short));
        assert_eq!(passed, Err(short));
        assert!(store.map().unwrap().is_none());
    }
}
