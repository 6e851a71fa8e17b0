//! Records of a part of the places, before all others: a pilot of the number of records.

use super::IrradianceCaching;
use crate::bsdf::Features;
use crate::memory::OutOfMemory;
use crate::method::{Executor, Round};
use crate::transport::cached::point_places::PointPlaces;

impl<'a, F: Features> IrradianceCaching<'a, F> {
    /// Adds the records of some `places` to the first cache, at most so many, as if it were restored from
    /// them. Returns whether that is done.
    ///
    /// # Errors
    /// Those of [`IrradianceCaching::fill`].
    pub fn fill_part<E: Executor>(
        &mut self,
        (places, most): (PointPlaces<'a>, usize),
        round: &mut Round<E>,
    ) -> Result<bool, OutOfMemory> {
        self.builders[0].limit(most);
        let (before, all) = (round.state.counters.all_rays(), self.points.replace(places));
        let finer = self.finer.take();
        let is_done = self.fill(0, None, round)?;
        (self.points, self.finer) = (all, finer);
        self.finer.iter_mut().for_each(|finer| finer.rays += round.state.counters.all_rays() - before);
        self.builders[0].limit(usize::MAX);
        if is_done && !self.is_cut {
            self.builders[0].tighten(1.0);
        }
        Ok(is_done)
    }
}
