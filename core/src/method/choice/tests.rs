//! Tests of the choice by predicted error.

use super::trial::SUPPLIES;
use super::*;
use crate::cache::radiance::LobeSettings;
use crate::method::MethodKind;
use crate::method::counts::pilot;
use crate::method::counts::prediction::Candidate;
use crate::method::counts::rarity::Rarity;
use crate::method::counts::{Choice, PilotNoise};

const TRIAL: Trial = Trial {
    noise: [4.0, 0.1, 0.1],
    work: [6.0; SUPPLIES],
    has_lobes: false,
    reuse: 1.0,
    pixels: 16384.0,
    triangles: 100,
    caches: TrialCaches { resolution: None, shards: 1, lobes: LobeSettings::DEFAULT },
    has_photons: false,
    gains: NoiseGains::NONE,
};

const GOAL: Goal = Goal { rays: Some(9e7), samples: None, error: None };

/// Light paths with a tenth of the noise × work of path tracing, whose rare light is the `rest`.
fn light_paths(rest: f32) -> Choice {
    let [light_paths, paths, rest] = [2.0, 20.0, rest].map(Rarity::often);
    let noise = PilotNoise { light_paths, work: 5.0, rests: [paths, rest, rest], work_of_paths: 5.0 };
    let counts = Candidate { light_paths: 1.0, connections: 1, merging: false };
    Choice { counts, gain: Some(10.0), noise, ..Choice::paths("") }
}

/// The same where light paths are no choice.
fn without(rest: f32) -> Choice {
    Choice { counts: Candidate::PATHS, ..light_paths(rest) }
}

#[test]
fn rare_light_is_that_of_records_or_stays_with_paths() {
    use MethodKind::{Bidirectional, IrradianceCache, Path};
    let best = |found: Result<Choice, _>| TRIAL.table(&GOAL, None, found, Err("")).best().kind;
    assert_eq!(best(Err("")), IrradianceCache);
    assert_eq!(best(Ok(light_paths(0.05))), IrradianceCache, "records have the rare light");
    assert_eq!(best(Ok(light_paths(20.0))), Bidirectional, "caustics are left to paths");
    // The noise of path tracing is the same where light paths are no choice.
    assert_eq!(best(Ok(without(20.0))), Path);
    assert_eq!(best(Ok(without(0.05))), IrradianceCache);
}

#[test]
fn a_reconstruction_reduces_noise_of_samples_and_leaves_that_of_records() {
    let gains = NoiseGains { samples: 4.0, beside_photons: 2.0 };
    // Ratios of the errors of all rows.
    let compared = |noise, has_photons| {
        let errors = |gains| {
            let pilot = MethodPilot { noise: 1.0, blur: 0.1, work: 6.0 };
            let trial = Trial { noise, has_photons, gains, ..TRIAL };
            trial.table(&GOAL, None, Ok(light_paths(0.05)), Ok(pilot)).0.map(|row| row.error)
        };
        let [raw, reconstructed] = [NoiseGains::NONE, gains].map(errors);
        core::array::from_fn::<_, { super::ROWS }, _>(|row| raw[row] / reconstructed[row])
    };
    let near = |ratio: f64, expected: f64| (ratio / expected - 1.0).abs() < 1e-3;
    let [path, cache, _, light_paths, photons] = compared([20.0, 0.1, 0.1], false);
    assert!(near(path, 4.0) && near(light_paths, 4.0), "{path} {light_paths}");
    assert!((1.0..2.0).contains(&cache), "records have most of the noise: {cache}");
    assert!((1.0..3.9).contains(&photons), "blur stays: {photons}");
    let [_, cache, ..] = compared([20.0, 19.9, 19.9], false);
    assert!((3.0..4.0).contains(&cache), "samples have most of the noise: {cache}");
    let [path, cache, ..] = compared([20.0, 19.9, 19.9], true);
    assert!(near(path, 4.0) && (1.5..2.0).contains(&cache), "beside photons: {path} {cache}");
}

#[test]
fn photons_take_the_place_of_methods_with_more_predicted_error() {
    let best = |noise: f64| {
        let pilot = MethodPilot { noise, blur: 0.0, work: 6.0 };
        TRIAL.table(&GOAL, None, Err(""), Ok(pilot)).best().kind
    };
    assert_eq!(best(1e-3), MethodKind::ProgressivePhotons);
    assert_eq!(best(1.0), MethodKind::IrradianceCache);
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
