//! Choice of a method by predicted error: a [`Table`] of candidates, each with its prediction, of which the
//! first is chosen that no other undercuts by enough. Predictions are those of a [`Trial`] of paths and
//! records and of the pilot of [`super::counts`]. Work is counted in rays and not in seconds: the choice
//! follows from scene, settings, seed, memory and, where time is limited, the number of threads.

mod goal;
mod prediction;
mod table;
mod trial;

pub use goal::Goal;
pub use prediction::ROWS;
pub use table::{Row, Table};
pub use trial::{Trial, TrialCaches, scratch};

#[cfg(test)]
mod tests;
