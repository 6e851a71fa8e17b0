//! kiddo's immutable tree with the query that suits each task best. For density estimates it only searches
//! photons, without weights.

use super::{Data, Rival, Searcher, Task};
use crate::Result;
use core::num::NonZero;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// The points of the tree.
pub(super) struct Kiddo<'p>(pub(super) &'p [[f32; 3]]);

struct Tree(ImmutableKdTree<f32, 3>);

impl Rival for Kiddo<'_> {
    fn name(&self) -> String {
        "kiddo".into()
    }

    fn build(&self) -> Result<Box<dyn Searcher + '_>> {
        match ImmutableKdTree::new_from_slice(self.0) {
            Ok(tree) => Ok(Box::new(Tree(tree))),
            Err(error) => Err(format!("kiddo: {error:?}").into()),
        }
    }
}

impl Searcher for Tree {
    fn run(&mut self, task: Task, data: &Data) -> Result<u64> {
        let mut found = 0;
        for query in task.queries(data) {
            let position = query.position.to_array();
            let query = self.0.query(&position);
            found += match task {
                Task::Nearest { k, radius } => {
                    let k = NonZero::new(k).unwrap_or(NonZero::<usize>::MIN);
                    let query = query.nearest_n::<SquaredEuclidean<f32>>(k);
                    if radius.is_finite() { query.within(radius * radius).execute() } else { query.execute() }
                }
                Task::Gather { radius } => {
                    query.within::<SquaredEuclidean<f32>>(radius * radius).unsorted().execute()
                }
            }
            .len() as u64;
        }
        Ok(found)
    }
}
