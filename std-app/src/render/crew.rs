//! The threads of a render, the round that they are in, and the film that the round adds to.

use super::workers::Workers;
use halflight_core::method::RenderState;
use std::time::Instant;

/// Samples and end of a round.
pub(super) struct Round {
    /// Samples per pixel at the end of the round.
    pub(super) target: u32,
    /// Samples of a tile between checks of the clock and the interrupt flag.
    pub(super) step: u32,
    /// When the round ends early.
    pub(super) deadline: Option<Instant>,
    /// Whether it is the first, which an interruption ends later than others.
    pub(super) is_first: bool,
}

/// Threads, round and film. Methods of the core run on them by [`Crew::round`].
pub(super) struct Crew<'r, 'm> {
    pub(super) workers: &'r Workers<'r>,
    pub(super) round: &'r Round,
    pub(super) canvas: &'r mut RenderState<'m>,
}
