//! What is said of samples that did not reach the picture.

use super::summary::plural;
use halflight::drive::Place;
use halflight_core::film::Dropped;
use halflight_core::transport::Counters;
use serde_json::{Value, json};

/// Places that are listed: those with the most.
const LISTED: usize = 64;

/// The object `dropped`.
pub(super) fn object(dropped: &Dropped, places: &[Place], empty_pixels: u64) -> Value {
    let mut object = causes(dropped);
    object["empty_pixels"] = empty_pixels.into();
    object["tiles"] = places.len().into();
    let place = |place: &Place| {
        let mut object = causes(&place.dropped);
        object["x"] = place.x.into();
        object["y"] = place.y.into();
        object["width"] = place.width.into();
        object["height"] = place.height.into();
        object
    };
    object["places"] = places.iter().take(LISTED).map(place).collect();
    object
}

fn causes(dropped: &Dropped) -> Value {
    json!({
        "nan": dropped.nan,
        "infinite": dropped.infinite,
        "negative": dropped.negative,
        "unfinished": dropped.unfinished,
    })
}

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
            plural(places.len(), "tile"),
            worst.dropped.total(),
            worst.x,
            worst.y
        ));
    }
    if empty_pixels > 0 {
        lines.push(format!("       {} black for want of any sample", plural(empty_pixels as usize, "pixel")));
    }
    lines
}
