//! nanoflann as the rival: its tree with leaves of ten points, unsorted results. Where we gather, it only finds.

use super::{Data, Searcher, Task};
use crate::bench::BenchError;
use halflight_nanoflann::Tree;

pub(super) struct Nanoflann<'p>(pub Tree<'p>);

pub(super) fn build(points: &[[f32; 3]]) -> Result<Tree<'_>, BenchError> {
    Tree::new(points).ok_or_else(|| BenchError::Rival("nanoflann refuses: there are no points".into()))
}

impl Searcher for Nanoflann<'_> {
    fn run(&mut self, task: Task, data: &Data) -> Result<u64, BenchError> {
        let search = |query: &super::Surfel| match task {
            Task::Nearest { k, radius } => self.0.nearest(query.place.to_array(), k, radius * radius),
            Task::Gather { radius } => self.0.within(query.place.to_array(), radius * radius),
        };
        Ok(task.queries(data).iter().map(search).sum::<usize>() as u64)
    }
}
