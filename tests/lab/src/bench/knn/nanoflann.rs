//! nanoflann's tree with leaves of ten points and unsorted results. For density estimates it only searches
//! photons, without weights.

use super::{Data, Rival, Searcher, Surfel, Task};
use crate::Result;
use halflight_nanoflann::Tree;

/// The points of the tree.
pub(super) struct Nanoflann<'p>(pub(super) &'p [[f32; 3]]);

struct Built<'p>(Tree<'p>);

impl Rival for Nanoflann<'_> {
    fn name(&self) -> String {
        "nanoflann".into()
    }

    fn build(&self) -> Result<Box<dyn Searcher + '_>> {
        let tree = Tree::new(self.0).ok_or("nanoflann: no points")?;
        Ok(Box::new(Built(tree)))
    }
}

impl Searcher for Built<'_> {
    fn run(&mut self, task: Task, data: &Data) -> Result<u64> {
        let search = |query: &Surfel| match task {
            Task::Nearest { k, radius } => self.0.nearest(query.position.to_array(), k, radius * radius),
            Task::Gather { radius } => self.0.within(query.position.to_array(), radius * radius),
        };
        Ok(task.queries(data).iter().map(search).sum::<usize>() as u64)
    }
}
