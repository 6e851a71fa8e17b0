//! kiddo as the rival: its immutable tree, and the query that suits the task best. Where we gather, it only finds.

use super::{Data, Searcher, Task};
use crate::bench::BenchError;
use core::num::NonZero;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

pub(super) type Tree = ImmutableKdTree<f32, 3>;

pub(super) fn build(points: &[[f32; 3]]) -> Result<Tree, BenchError> {
    Tree::new_from_slice(points).map_err(|error| BenchError::Rival(format!("kiddo refuses: {error:?}")))
}

pub(super) struct Kiddo(pub Tree);

impl Searcher for Kiddo {
    fn run(&mut self, task: Task, data: &Data) -> Result<u64, BenchError> {
        let mut found = 0;
        for query in task.queries(data) {
            let place = query.place.to_array();
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
