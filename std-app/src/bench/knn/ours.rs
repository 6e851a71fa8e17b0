//! Our photon map as the bench drives it: one search after the other, and all of them at once.

use super::{Data, Searcher, Surfel, Task};
use crate::bench::BenchError;
use glam::Vec3;
use halflight_core::bvh::ForkJoin;
use halflight_core::memory::{Arena, Footprint, Line, OutOfMemory};
use halflight_core::photon::{
    Density, Kernel, Neighbours, Photon, PhotonMap, Photons, QueryDisc, QueryOrder, Uniform,
};
use halflight_core::{Level, Rgb};

/// Photons as a renderer has them when it builds: as records, in the order in which they were shot.
pub(super) fn records(photons: &[Surfel]) -> Vec<Photon> {
    let record = |surfel: &Surfel| Photon::new(surfel.place, surfel.normal, surfel.normal, Rgb::ONE);
    photons.iter().map(record).collect()
}

/// Puts the records into fresh memory and builds the map there.
pub(super) fn build<'m>(
    records: &[Photon],
    memory: &'m mut Vec<Line>,
    join: &impl ForkJoin,
) -> Result<PhotonMap<'m>, BenchError> {
    *memory = lines(Photons::footprint(records.len()))?;
    let mut photons = Photons::new(records.len(), &mut Arena::new(bytemuck::cast_slice_mut(memory)))?;
    photons.as_mut_slice().copy_from_slice(records);
    Ok(photons.build_with(records.len(), join))
}

fn lines(footprint: Footprint) -> Result<Vec<Line>, OutOfMemory> {
    let mut lines = Vec::new();
    let needed = footprint.bytes();
    let count = needed.div_ceil(size_of::<Line>());
    lines.try_reserve_exact(count).map_err(|_| OutOfMemory { needed, available: 0 })?;
    lines.resize(count, Line([0; size_of::<Line>()]));
    Ok(lines)
}

/// One search after the other, in the order of the queries.
pub(super) struct Singly<'a> {
    pub map: &'a PhotonMap<'a>,
    pub level: Level,
}

/// All searches in one call.
pub(super) struct Together<'a> {
    pub map: &'a PhotonMap<'a>,
    pub level: Level,
}

fn disc(query: &Surfel, radius: f32) -> QueryDisc {
    QueryDisc { place: query.place, normal: query.normal, radius, kernel: Kernel::Epanechnikov }
}

/// Runs `search` with working memory for `k` neighbours.
fn with_neighbours<T>(k: usize, search: impl FnOnce(&mut Neighbours) -> T) -> Result<T, BenchError> {
    let mut memory = lines(Neighbours::footprint(k))?;
    let mut neighbours = Neighbours::new(k, &mut Arena::new(bytemuck::cast_slice_mut(&mut memory)))?;
    Ok(search(&mut neighbours))
}

impl Searcher for Singly<'_> {
    fn run(&mut self, task: Task, data: &Data) -> Result<u64, BenchError> {
        let mut found = 0;
        match task {
            Task::Nearest { k, radius } => with_neighbours(k, |neighbours| {
                for query in task.queries(data) {
                    self.map.nearest(self.level, query.place, radius, neighbours);
                    found += neighbours.len() as u64;
                }
            })?,
            Task::Gather { radius } => {
                for query in task.queries(data) {
                    let density = self.map.gather(self.level, &disc(query, radius), &Uniform(Rgb::ONE));
                    found += u64::from(density.photons);
                }
            }
        }
        Ok(found)
    }
}

impl Searcher for Together<'_> {
    fn run(&mut self, task: Task, data: &Data) -> Result<u64, BenchError> {
        let queries = task.queries(data);
        let mut turns = vec![QueryOrder::default(); queries.len()];
        let mut found = 0;
        match task {
            Task::Nearest { k, radius } => {
                let places: Vec<Vec3> = queries.iter().map(|query| query.place).collect();
                with_neighbours(k, |neighbours| {
                    self.map.nearest_batch(self.level, &places, radius, &mut turns, neighbours, |_, near| {
                        found += near.len() as u64;
                    });
                })?;
            }
            Task::Gather { radius } => {
                let discs: Vec<QueryDisc> = queries.iter().map(|query| disc(query, radius)).collect();
                let mut densities = vec![Density::default(); discs.len()];
                self.map.gather_batch(self.level, &discs, &Uniform(Rgb::ONE), &mut turns, &mut densities);
                found = densities.iter().map(|density| u64::from(density.photons)).sum();
            }
        }
        Ok(found)
    }
}
