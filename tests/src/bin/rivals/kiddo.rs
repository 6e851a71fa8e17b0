//! kiddo's immutable tree with the query that suits each task best. For density estimates it only searches
//! photons, without weights.

use core::num::NonZero;
use halflight::bench::BenchError;
use halflight::bench::knn::{Data, Rival, Searcher, Task};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// The points of the tree.
pub(crate) struct Kiddo<'p>(pub(crate) &'p [[f32; 3]]);

struct Tree(ImmutableKdTree<f32, 3>);

impl Rival for Kiddo<'_> {
    fn name(&self) -> String {
        "kiddo".into()
    }

    fn build(&self) -> Result<Box<dyn Searcher + '_>, BenchError> {
        match ImmutableKdTree::new_from_slice(self.0) {
            Ok(tree) => Ok(Box::new(Tree(tree))),
            Err(error) => Err(BenchError::Rival(format!("kiddo: {error:?}"))),
        }
    }
}

impl Searcher for Tree {
    fn run(&mut self, task: Task, data: &Data) -> Result<u64, BenchError> {
        let mut found = 0;
        for query in task.queries(data) {
            let place = query.position.to_array();
            let query = self.0.query(&place);
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
