//! Our photon map: one query per call, and all queries in one call.

use super::{Data, Searcher, Surfel, Task};
use crate::Result;
use glam::Vec3;
use halflight::pages::Pages;
use halflight_core::bvh::ForkJoin;
use halflight_core::memory::{Arena, OutOfMemory};
use halflight_core::photon::{
    DensityEstimate, Kernel, Neighbours, Photon, PhotonMap, Photons, QueryDisc, QueryOrder, Uniform,
};
use halflight_core::{Level, Rgb};

/// Photons of the renderer, in the order of emission.
pub(super) fn records(photons: &[Surfel]) -> Vec<Photon> {
    let record = |surfel: &Surfel| Photon::new(surfel.position, surfel.normal, surfel.normal, Rgb::ONE);
    photons.iter().map(record).collect()
}

/// Builds the map of `records` in new memory.
pub(super) fn build<'m>(
    records: &[Photon],
    memory: &'m mut Pages,
    join: &impl ForkJoin,
) -> core::result::Result<PhotonMap<'m>, OutOfMemory> {
    *memory = Pages::new(Photons::footprint(records.len()))?;
    let mut photons = Photons::new(records.len(), &mut Arena::over(memory))?;
    photons.as_mut_slice().copy_from_slice(records);
    Ok(photons.build_with(records.len(), join))
}

/// One query per call, in the order of the queries.
pub(super) struct Single<'a> {
    pub(super) map: &'a PhotonMap<'a>,
    pub(super) level: Level,
}

/// All queries in one call.
pub(super) struct Batched<'a> {
    pub(super) map: &'a PhotonMap<'a>,
    pub(super) level: Level,
}

fn disc(query: &Surfel, radius: f32) -> QueryDisc {
    QueryDisc { place: query.position, normal: query.normal, radius, kernel: Kernel::Epanechnikov }
}

/// Runs `search` with working memory for `k` neighbours.
fn with_neighbours<T>(k: usize, search: impl FnOnce(&mut Neighbours) -> T) -> Result<T> {
    let mut memory = Pages::new(Neighbours::footprint(k))?;
    let mut neighbours = Neighbours::new(k, &mut Arena::over(&mut memory))?;
    Ok(search(&mut neighbours))
}

impl Searcher for Single<'_> {
    fn run(&mut self, task: Task, data: &Data) -> Result<u64> {
        let mut found = 0;
        match task {
            Task::Nearest { k, radius } => with_neighbours(k, |neighbours| {
                for query in task.queries(data) {
                    self.map.nearest(self.level, query.position, radius, neighbours);
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

impl Searcher for Batched<'_> {
    fn run(&mut self, task: Task, data: &Data) -> Result<u64> {
        let queries = task.queries(data);
        let mut order = vec![QueryOrder::default(); queries.len()];
        let mut found = 0;
        match task {
            Task::Nearest { k, radius } => {
                let positions: Vec<Vec3> = queries.iter().map(|query| query.position).collect();
                with_neighbours(k, |neighbours| {
                    self.map.nearest_batch(
                        self.level,
                        &positions,
                        radius,
                        &mut order,
                        neighbours,
                        |_, near| {
                            found += near.len() as u64;
                        },
                    );
                })?;
            }
            Task::Gather { radius } => {
                let discs: Vec<QueryDisc> = queries.iter().map(|query| disc(query, radius)).collect();
                let mut densities = vec![DensityEstimate::default(); discs.len()];
                self.map.gather_batch(self.level, &discs, &Uniform(Rgb::ONE), &mut order, &mut densities);
                found = densities.iter().map(|density| u64::from(density.photons)).sum();
            }
        }
        Ok(found)
    }
}
