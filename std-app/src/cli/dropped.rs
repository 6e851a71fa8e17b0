//! Rejected samples as lines of a summary.

use halflight::render::RejectedTile;
use halflight::report::quantity::plural;
use halflight_core::transport::Counters;

/// Lines with causes and the worst tile; none if no sample was rejected.
pub(super) fn text(counters: &Counters, tiles: &[RejectedTile], empty_pixels: u64) -> Vec<String> {
    let dropped = &counters.dropped;
    if dropped.total() == 0 {
        return Vec::new();
    }
    let mut lines = vec![format!(
        "dropped {} of {} samples: {} not a number, {} infinite, {} negative, {} unfinished",
        dropped.total(),
        counters.paths,
        dropped.nan,
        dropped.infinite,
        dropped.negative,
        dropped.unfinished
    )];
    lines.extend(tiles.first().map(|worst| {
        let (count, x, y) = (worst.dropped.total(), worst.x, worst.y);
        format!(
            "       in {}, most of them ({count}) in the tile at ({x}, {y})",
            plural(tiles.len() as u64, "tile")
        )
    }));
    if empty_pixels > 0 {
        lines.push(format!("       {} without any sample left: black", plural(empty_pixels, "pixel")));
    }
    lines
}
