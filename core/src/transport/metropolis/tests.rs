//! Lengths, techniques and the division of light.

use super::bootstrap::Lengths;
use super::split::{PrimarySpace, Split};
use crate::Rgb;
use crate::transport::walk::techniques::Weighted;
use std::vec::Vec;

#[test]
fn lengths_are_chosen_by_their_weight_and_none_never() {
    let lengths = Lengths::new(3..=7, |segments| if segments == 4 { 3.0 } else { 0.0 });
    let mut counts = [0u32; 8];
    for i in 0..10_000 {
        let (segments, probability) = lengths.choose((i as f32 + 0.5) / 10_000.0);
        counts[segments as usize] += 1;
        let expected = if segments == 4 { 0.92 } else { 0.02 };
        assert!((probability - expected).abs() < 1e-6);
    }
    assert!(counts.iter().zip([0, 0, 0, 200, 9200, 200, 200, 200]).all(|(a, b)| a.abs_diff(b) <= 1));
    assert_eq!(Lengths::new(3..=3, |_| 0.0).choose(0.999), (3, 1.0));
}

#[test]
fn path_tracing_and_chains_share_all_light_and_paths_keep_that_of_the_balance_heuristic() {
    let levels = [2.0];
    let space = PrimarySpace::Multiplexed;
    let split = Split { levels: &levels, threshold: 8.0, max_segments: 20, space };
    let with = |radiance: f32, by_paths: f32| Weighted { radiance: Rgb::splat(radiance), by_paths };
    // The path tracer's own contribution is 20 / 0.25.
    assert!((split.of_paths(63, 3, &with(20.0, 0.25)) - 0.25).abs() < 1e-6);
    assert!((split.of_paths(63, 3, &with(8.0, 0.25)) - 0.5).abs() < 1e-6);
    assert_eq!(split.of_paths(0, 3, &with(1e9, 0.5)), 0.5);
    let of_paths = Split { space: PrimarySpace::PathTracing, ..split };
    assert!((of_paths.of_paths(63, 3, &with(20.0, 0.5)) - 0.4).abs() < 1e-6);
    // Nothing else finds it.
    assert_eq!(split.of_paths(0, 3, &with(1e9, 1.0)), 1.0);
    assert_eq!(split.of_paths(0, 3, &with(1.0, 0.5)), 1.0);
    assert_eq!(split.of_paths(0, 3, &with(1.0, 0.0)), 0.0);
    let ends: Vec<f32> = [2, 21].map(|n| split.of_paths(0, n, &with(1e9, 0.5))).to_vec();
    assert_eq!(ends, [1.0, 1.0]);
    // Beyond the levels.
    assert_eq!(split.of_paths(64, 3, &with(4.0, 0.25)), 0.5);
}
