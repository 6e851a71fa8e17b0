//! What is said of samples that did not reach the picture: the lines for a person.

use halflight::drive::Place;
use halflight::report::words::plural;
use halflight_core::transport::Counters;

/// Lines for a person; none where nothing was dropped.
pub(super) fn text(counters: &Counters, places: &[Place], empty_pixels: u64) -> Vec<String> {
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
    if let Some(worst) = places.first() {
        lines.push(format!(
            "       in {}, most of them ({}) within 16 pixels right of and below ({}, {})",
            plural(places.len() as u64, "tile"),
            worst.dropped.total(),
            worst.x,
            worst.y
        ));
    }
    if empty_pixels > 0 {
        lines.push(format!("       {} black for want of any sample", plural(empty_pixels, "pixel")));
    }
    lines
}
