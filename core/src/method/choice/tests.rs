//! Tests of the choice by predicted error.

use super::*;

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
fn light_paths(rest: f64) -> Option<LightPaths> {
    Some(LightPaths { product: 10.0, of_paths: 100.0, of_rest: [rest; 2] })
}

#[test]
fn rare_light_is_that_of_records_or_stays_with_paths() {
    let best = |found| TRIAL.best(&GOAL, true, found).0;
    let is_cache = |best| matches!(best, Best::Cache(_));
    assert!(is_cache(best(None)));
    assert!(is_cache(best(light_paths(0.05))), "records have the rare light");
    assert_eq!(best(light_paths(20.0)), Best::LightPaths, "caustics are left to paths");
    // The noise of path tracing is the same where light paths are no choice.
    let others = light_paths(20.0).map(LightPaths::of_others);
    assert_eq!(best(others), Best::Paths);
    assert!(is_cache(best(light_paths(0.05).map(LightPaths::of_others))));
}

#[test]
fn pilots_of_long_pictures_have_more_pixels_where_time_alone_ends_them() {
    let part = |goal| TRIAL.part_of_pilot(&goal);
    let of_time = |rays| Goal { rays: Some(rays), ..Goal::default() };
    assert_eq!(part(of_time(9e7)), 1);
    assert_eq!(part(of_time(1.8e7)), 4);
    assert_eq!(part(of_time(1e6)), pilot::PART);
    assert_eq!(part(Goal { samples: Some(4096), ..of_time(9e7) }), pilot::PART);
}
