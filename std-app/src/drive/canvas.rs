//! What a render has done so far: the film, how far each tile is, what was counted. All that a film file keeps.

use super::ledger::Ledger;
use halflight_core::film::{Film, PIXELS_PER_TILE};
use halflight_core::transport::Counters;

/// A part of a picture: every `count`th tile from tile `index` on. Shards of one picture are rendered apart and
/// merged to the same bits as one render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which part, counted from 0.
    pub index: u32,
    /// How many parts there are.
    pub count: u32,
}

impl Shard {
    /// The whole picture.
    pub const WHOLE: Shard = Shard { index: 0, count: 1 };

    /// Whether tile `task` belongs to it.
    pub fn owns(&self, task: usize) -> bool {
        task % self.count.max(1) as usize == self.index as usize
    }
}

/// See the file.
pub(super) struct Canvas<'m> {
    pub(super) film: Film<'m>,
    /// Samples that each pixel of a tile has had; 0 for tiles of other shards.
    pub(super) taken: Vec<u32>,
    pub(super) shard: Shard,
    /// Whether pixels far apart share what their samples find.
    pub(super) shares: bool,
    pub(super) counters: Counters,
    pub(super) ledger: Ledger,
}

impl<'m> Canvas<'m> {
    pub(super) fn new(film: Film<'m>, shard: Shard) -> Self {
        let tiles = film.pixels().len() / PIXELS_PER_TILE;
        let (counters, ledger) = (Counters::default(), Ledger::default());
        Self { film, taken: vec![0; tiles], shard, shares: false, counters, ledger }
    }

    /// Tiles of this shard.
    pub(super) fn tiles(&self) -> usize {
        (0..self.taken.len()).filter(|&task| self.shard.owns(task)).count()
    }

    /// Samples of each pixel of its tiles, of the least sampled one.
    pub(super) fn spp(&self) -> u32 {
        let own = self.taken.iter().enumerate().filter(|(task, _)| self.shard.owns(*task));
        own.map(|(_, taken)| *taken).min().unwrap_or(0)
    }
}
