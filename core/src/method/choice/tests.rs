//! Tests of the choice by predicted error.

use super::*;
use crate::method::counts::pilot;
use crate::method::counts::rarity::Rarity;

const TRIAL: Trial = Trial {
    noise: [4.0, 0.1, 0.1],
    work: [6.0; SUPPLIES],
    has_lobes: false,
    reuse: 1.0,
    pixels: 16384.0,
    triangles: 100,
    resolution: None,
    shards: 1.0,
    has_photons: false,
};

const GOAL: Goal = Goal { rays: Some(9e7), samples: None, error: None };

/// Light paths with a tenth of the noise × work of path tracing, whose rare light is the `rest`.
fn light_paths(rest: f32) -> Option<LightPaths> {
    let [light_paths, paths, rest] = [2.0, 20.0, rest].map(Rarity::often);
    let noise = PilotNoise { light_paths, work: 5.0, rests: [paths, rest, rest], work_of_paths: 5.0 };
    Some(LightPaths { noise, are_choice: true })
}

fn without(found: Option<LightPaths>) -> Option<LightPaths> {
    found.map(|found| LightPaths { are_choice: false, ..found })
}

#[test]
fn rare_light_is_that_of_records_or_stays_with_paths() {
    let best = |found| TRIAL.best(&GOAL, true, found).0;
    let is_cache = |best| matches!(best, Best::Cache(_));
    assert!(is_cache(best(None)));
    assert!(is_cache(best(light_paths(0.05))), "records have the rare light");
    assert_eq!(best(light_paths(20.0)), Best::LightPaths, "caustics are left to paths");
    // The noise of path tracing is the same where light paths are no choice.
    let others = without(light_paths(20.0));
    assert_eq!(best(others), Best::Paths);
    assert!(is_cache(best(without(light_paths(0.05)))));
}

#[test]
fn pilots_of_long_pictures_have_more_pixels_where_time_alone_ends_them() {
    let part = |goal: Goal| goal.part_of_pilot(TRIAL.pixels as usize);
    let of_time = |rays| Goal { rays: Some(rays), ..Goal::default() };
    assert_eq!(part(of_time(3e8)), 1);
    assert_eq!(part(of_time(6e7)), 4);
    assert_eq!(part(of_time(1e6)), 32);
    assert_eq!(part(Goal { samples: Some(4096), ..of_time(9e7) }), pilot::PART);
}
