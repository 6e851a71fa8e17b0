//! Merged audits of the shards of a picture: strata of shards are strata of the picture.

use super::choice::{Grid, ordered};
use super::{Shard, State};
use halflight_core::film::{Film, PIXELS_PER_TILE, Tile};
use std::collections::HashMap;

impl State {
    /// Audit of the whole picture `film`, whose mean is `mean`, from the audits of all shards; `None` if a
    /// shard has no samples.
    pub(in crate::render) fn merged(states: Vec<(Shard, Self)>, film: &Film, mean: f64) -> Option<Self> {
        let count = states.iter().map(|(_, state)| state.places.len()).sum();
        let grid = Grid::new([film.width(), film.height()], count);
        let order = ordered(film, Shard::WHOLE, mean, grid);
        let owner = |shard: Shard| {
            let size = [film.width(), film.height()];
            move |[x, y]: &&[u32; 2]| shard.owns(Tile::position(size, *x, *y) / PIXELS_PER_TILE)
        };
        // Mean number of pixels per stratum.
        let mean_size = order.len() as f64 / count as f64;

        let mut merged = Self { taken: u32::MAX, ..Self::default() };
        let mut strata = HashMap::with_capacity(count);
        for (shard, state) in states {
            if state.taken == 0 {
                return None;
            }
            let own = order.iter().filter(owner(shard)).count() as f64;
            let size = (own / state.places.len() as f64 / mean_size) as f32;
            let shares = state.shares.iter().map(|share| share * size);
            strata.extend(state.places.into_iter().zip(shares.zip(state.pixels)));
            merged.share += state.share * own / order.len() as f64;
            merged.taken = merged.taken.min(state.taken);
            merged.rays += state.rays;
            merged.seconds += state.seconds;
            merged.has_photons |= state.has_photons;
            merged.unseen = merged.unseen.max(state.unseen);
        }
        for place in order {
            if let Some((share, pixel)) = strata.remove(&place) {
                merged.places.push(place);
                merged.shares.push(share);
                merged.pixels.push(pixel);
            }
        }
        // Positions outside the picture mean a damaged state.
        strata.is_empty().then_some(merged)
    }
}
