//! The audits of the shards of one picture, put together: their strata are strata of the picture.

use super::choice::{Grid, ordered};
use super::{Shard, State};
use halflight_core::film::Film;
use std::collections::HashMap;

impl State {
    /// Of the whole picture `film`, of mean `mean`, from those of all of its shards; `None` where one has nothing.
    pub(in crate::drive) fn merged(states: Vec<(Shard, Self)>, film: &Film, mean: f64) -> Option<Self> {
        let count = states.iter().map(|(_, state)| state.places.len()).sum();
        let grid = Grid::new([film.width(), film.height()], count);
        let order = ordered(film, Shard::WHOLE, mean, grid);
        let rank: HashMap<_, _> = order.iter().enumerate().map(|(rank, place)| (*place, rank)).collect();
        // Pixels of a stratum in the mean of all.
        let mean_size = order.len() as f64 / count as f64;

        let mut merged = Self { taken: u32::MAX, ..Self::default() };
        let mut strata = Vec::with_capacity(count);
        for (shard, state) in states {
            if state.taken == 0 {
                return None;
            }
            let own = ordered(film, shard, mean, grid).len() as f64;
            let size = (own / state.places.len() as f64 / mean_size) as f32;
            let shares = state.shares.iter().map(|share| share * size);
            for ((place, share), pixel) in state.places.iter().zip(shares).zip(state.pixels) {
                strata.push((*rank.get(place)?, *place, share, pixel));
            }
            merged.share += state.share * own / order.len() as f64;
            merged.taken = merged.taken.min(state.taken);
            merged.rays += state.rays;
            merged.seconds += state.seconds;
        }
        strata.sort_unstable_by_key(|(rank, ..)| *rank);
        for (_, place, share, pixel) in strata {
            merged.places.push(place);
            merged.shares.push(share);
            merged.pixels.push(pixel);
        }
        Some(merged)
    }
}
