//! Stored coefficients beside those in f32.

use super::*;
use crate::cache::radiance::derivatives::border_flux;
use crate::cache::radiance::zernike::{COUNT_MAX, count};
use crate::cache::skies::{Sky, with_strata};
use crate::memory::Line;
use std::vec;

/// Coefficients and gradients of a sky with a near wall, coloured.
fn light(degree: usize, scale: f32) -> (Coefficients, Gradients) {
    let sky =
        Sky::with_hits(32, |w| (scale * (0.4 + 0.3 * w[0] + w[1] * w[1]), 1.0 + w[0], [0.0, 0.0, -1.0]));
    with_strata(32, degree, |tables| {
        let mut found = Coefficients::project(Level::detect(), tables, &sky.hemisphere()).unwrap();
        found.values[2] = found.values[2].map(|value| 0.1 * value);
        (found, border_flux(Level::detect(), tables, &sky.hemisphere()).unwrap().gradients)
    })
}

fn lobe() -> [f32; COUNT_MAX] {
    core::array::from_fn(|k| 0.4 / (1.0 + k as f32))
}

fn of(degree: usize) -> Representation {
    Representation { basis: Basis::Zernike, degree }
}

fn with_pool<T>(records: usize, degree: usize, work: impl FnOnce(&mut CoefficientPool) -> T) -> T {
    let mut lines = vec![Line([0; 64]); CoefficientPool::footprint(records, of(degree)).bytes() / 64];
    let mut arena = Arena::new(bytemuck::cast_slice_mut(&mut lines));
    work(&mut CoefficientPool::new(records, of(degree), &mut arena).unwrap())
}

#[test]
fn half_floats_reflect_what_f32_reflects() {
    /// Rounding to eleven bits.
    const HALF: f32 = 2e-3;
    for degree in [0, 2, 3, 4, 6, 8] {
        for scale in [1.0, 1e-12, 1e12] {
            let ((light, gradients), lobe) = (light(degree, scale), lobe());
            with_pool(1, degree, |pool| {
                let record = pool.push(&Expansion::zernike(&light, &gradients), 0.05).unwrap();
                for delta in [Vec2::ZERO, Vec2::new(0.02, -0.03)] {
                    let weights = Weights::new(&lobe[..count(degree)]);
                    let found = pool.reflected(Level::detect(), &record, &weights, delta).to_array();
                    for channel in 0..3 {
                        let mut wanted = 0.0;
                        for k in 0..count(degree) {
                            let slope = Vec2::from(gradients[channel][k]).dot(delta);
                            let slope = if k < of(degree).of_gradients().count() { slope } else { 0.0 };
                            wanted += lobe[k] * (light.values[channel][k] + slope);
                        }
                        let off = (found[channel] - wanted).abs() / wanted;
                        assert!(off < HALF, "{degree} {scale}: {} {wanted}", found[channel]);
                    }
                }
            });
        }
    }
}

#[test]
fn lookups_have_the_same_bits_on_every_level_and_in_a_mean() {
    let ((light, gradients), weights) = (light(6, 1.0), Weights::new(&lobe()[..count(6)]));
    with_pool(3, 6, |pool| {
        let records =
            [0.05, 0.1, 0.2].map(|unit| pool.push(&Expansion::zernike(&light, &gradients), unit).unwrap());
        assert!(pool.push(&Expansion::zernike(&light, &gradients), 0.1).is_none());
        assert_eq!(pool.used() * 32, 3 * 384);
        let delta = Vec2::new(0.01, 0.02);
        let of = |level, record| pool.reflected(level, record, &weights, delta);
        let found = of(Level::BASELINE, &records[0]);
        for level in Level::detect().and_below() {
            assert_eq!(of(level, &records[0]), found, "{level:?}");
            let alone = pool.interpolated(level, &weights, [(0.5, &records[0], delta)]).unwrap();
            assert_eq!(alone, found);
        }
        let mean = pool.interpolated(Level::detect(), &weights, records.iter().map(|r| (0.3, r, delta)));
        assert!((mean.unwrap() / found - 1.0).abs().max_element() < 2e-3);
        assert_eq!(pool.interpolated(Level::detect(), &weights, []), None);
    });
}

#[test]
fn extrapolation_stays_within_bounds_and_black_channels_stay_black() {
    let ((mut light, gradients), weights) = (light(4, 1.0), Weights::new(&lobe()[..count(4)]));
    light.values[1] = [0.0; COUNT_MAX];
    with_pool(1, 4, |pool| {
        let record = pool.push(&Expansion::zernike(&light, &gradients), 0.1).unwrap();
        let at = |delta| pool.reflected(Level::detect(), &record, &weights, delta);
        let here = at(Vec2::ZERO);
        for delta in [Vec2::new(1e4, 0.0), Vec2::new(-1e4, 0.0), Vec2::new(0.0, f32::MAX)] {
            let ratio = at(delta).x / here.x;
            assert!((0.0499..20.01).contains(&ratio), "{delta}: {ratio}");
            assert_eq!(at(delta).y, 0.0);
        }
    });
}

/// Records from files may hold any bits.
#[test]
fn any_record_and_any_weights_are_no_panic() {
    with_pool(2, 3, |pool| {
        let (light, gradients) = light(3, f32::NAN);
        let record = pool.push(&Expansion::zernike(&light, &gradients), f32::INFINITY).unwrap();
        let weights = Weights::new(&[f32::INFINITY; 1000]);
        for (offset, groups) in [(0, [1, 1]), (u32::MAX, [1, 1]), (1, [u16::MAX; 2]), (0, [0, 5])] {
            let record = PooledRecord { offset, groups, ..record };
            let _ = pool.reflected(Level::detect(), &record, &weights, Vec2::NAN);
        }
    });
    assert!(CoefficientPool::new(usize::MAX, of(8), &mut Arena::new(&mut [])).is_err());
}
