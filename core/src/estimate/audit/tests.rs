//! Bias found by audits of films of known bias.

use super::*;
use crate::estimate::Deviation;
use crate::film::Dropped;
use crate::sampling::Random;
use libm::log;
use std::vec::Vec;

/// A pixel of `light` with uniform noise of ± 1 per sample.
fn pixel(light: f32, samples: u32, random: Random) -> Pixel {
    let mut pixel = Pixel::default();
    for sample in 0..samples {
        let noise = |channel| 2.0 * random.single(3 * sample + channel) - 1.0;
        let colour = Rgb::splat(light) + Rgb::new(noise(0), noise(1), noise(2));
        pixel.add(sample, colour, &mut Dropped::default());
    }
    pixel
}

/// Findings of `count` pixels of radiance 2, too bright by `bias`, in a picture of mean 2.
fn findings(count: u32, bias: f32, seed: u32) -> Vec<PixelBias> {
    let of = |i: u32| {
        let picture = pixel(2.0 + bias, 8, Random::new(seed, 2 * i));
        let truth = pixel(2.0, 16, Random::new(seed, 2 * i + 1));
        PixelBias::of(&picture, &truth, Rgb::splat(2.0 + bias), 2.0).unwrap()
    };
    (0..count).map(of).collect()
}

fn estimate(findings: &[PixelBias]) -> BiasEstimate {
    BiasEstimate::of(findings.iter().map(|finding| (*finding, 1.0))).unwrap()
}

#[test]
fn what_is_not_there_is_found_as_often_as_said_in_skew_findings() {
    // Product of two values above −1, each −log of a random number: 1 in the mean.
    let (runs, count) = (4000, 256);
    let found = |sign: f64| {
        let run = |run| {
            let random = Random::new(3, run);
            let value = |i: u32| {
                (0..2).map(|half| -log(1.0 - f64::from(random.single(2 * i + half)))).product::<f64>()
            };
            let finding =
                |i| PixelBias { bias: sign * (value(i) - 1.0), deviation: 0.0, variances: [0.0; 2] };
            BiasEstimate::of((0..count).map(|i| (finding(i), 1.0))).unwrap().is_significant()
        };
        (0..runs).filter(|i| run(*i)).count() as f64 / f64::from(runs)
    };
    // 0.8 and 5.6 % by the normal distribution; one standard error is 0.25 %.
    assert!((found(1.0) - 0.025).abs() < 0.008, "{}", found(1.0));
    assert!((found(-1.0) - 0.025).abs() < 0.015, "{}", found(-1.0));
}

#[test]
fn what_all_findings_agree_on_is_found() {
    for bias in [0.1, 1e-3, 3.3e5] {
        let finding = PixelBias { bias, deviation: 0.0, variances: [0.0; 2] };
        let of = |sign: f64| {
            let finding = PixelBias { bias: sign * bias, ..finding };
            BiasEstimate::of((0..256).map(|_| (finding, 1.0))).unwrap()
        };
        assert!(
            of(1.0).is_significant() && of(1.0).detectable > 0.0 && of(1.0).lower > 0.99 * bias,
            "{:?}",
            of(1.0)
        );
        assert!(!of(-1.0).is_significant() && of(-1.0).upper >= 0.0, "{:?}", of(-1.0));
    }
}

#[test]
fn one_firefly_is_no_bias_wherever_it_is() {
    for place in [0, 1, 128, 255] {
        let finding = |i| PixelBias {
            bias: if i == place { 200.0 } else { 0.01 },
            deviation: 0.0,
            variances: [0.0; 2],
        };
        let bias = BiasEstimate::of((0..256).map(|i| (finding(i), 1.0))).unwrap();
        assert!(bias.relmse > 0.7 && !bias.is_significant(), "{place} {bias:?}");
    }
}

#[test]
fn what_is_certain_of_a_bias_is_nothing_below_four_standard_errors() {
    for relmse in [-1e9, -10.0, -2.0, -0.5, 0.0, 0.5, 2.0, 3.9] {
        assert_eq!(BiasEstimate::from_moments(relmse, 1.0, 0.0, 0.0).least(), 0.0, "{relmse}");
    }
    for relmse in [4.0, 10.0, 1e9] {
        let least = BiasEstimate::from_moments(relmse, 1.0, 0.0, 0.0).least();
        assert!((least - (relmse - 2.0 * Z)).abs() < 1e-9 * relmse, "{relmse} {least}");
    }
}

#[test]
fn no_bias_is_found_where_there_is_none() {
    let (mut found, mut strange, runs) = (0, 0, 400);
    for seed in 0..runs {
        let findings = findings(64, 0.0, seed);
        found += u32::from(estimate(&findings).is_significant());
        let deviation = Deviation::of(findings.iter().map(|finding| finding.deviation));
        strange += u32::from(deviation.chance() < 0.05);
    }
    // 2.5 % of 400 are 10, more than 20 have a chance of 0.2 %; 5 % are 20, more than 35 one of 0.1 %.
    assert!(found <= 20, "{found} of {runs}");
    assert!((8..=35).contains(&strange), "{strange} of {runs}");
}

#[test]
fn what_quarters_know_of_each_other_is_no_deviation() {
    // In each half, the excess of one quarter equals the deficit of the other.
    for signs in [[0.9, 0.9], [0.9, -0.9], [-0.9, 0.5]] {
        let mut truth = Pixel::default();
        for (sample, half) in [0, 1, 0, 1].into_iter().enumerate() {
            let sign = if sample < 2 { signs[half] } else { -signs[half] };
            truth.add(sample as u32, Rgb::splat(1.0 + sign), &mut Dropped::default());
        }
        let mut picture = Pixel::default();
        for sample in 0..2 {
            picture.add(sample, Rgb::ONE, &mut Dropped::default());
        }
        let finding = PixelBias::of(&picture, &truth, Rgb::ONE, 1.0).unwrap();
        assert!(finding.deviation.abs() < 1e-6, "{finding:?}");
    }
}

#[test]
fn both_variances_are_known() {
    let findings = findings(1000, 0.0, 9);
    let mean = |of: usize| findings.iter().map(|finding| finding.variances[of]).sum::<f64>() / 1000.0;
    // Variance of a third per sample, over 2² + 0.01 · 2²; means of squares of 1000 pixels of three channels.
    for (found, samples) in [(mean(0), 8.0), (mean(1), 16.0)] {
        let expected = 1.0 / 3.0 / samples / 4.04;
        assert!((found / expected - 1.0).abs() < 0.12, "{found} {expected}");
    }
}

#[test]
fn the_sum_of_noise_and_no_bias_errs_hardly_more_often_than_each() {
    let (mut missed, runs) = (0, 100_000);
    let random = Random::new(1, 2);
    for run in 0..runs {
        // Box and Muller. The noise is 1, known to a tenth; the standard error of the audit is 1.
        let [radius, angle] = [0, 1].map(|i| f64::from(random.single(2 * run + i)));
        let (sine, cosine) = libm::sincos(core::f64::consts::TAU * angle);
        let radius = sqrt(-2.0 * log(1.0 - radius));
        let relmse = 1.0 + 0.1 * radius * sine;
        let noise = ErrorEstimate { relmse, lower: relmse - 0.1 * Z, upper: relmse + 0.1 * Z };
        let sum = noise.with_bias(BiasEstimate::from_moments(radius * cosine, 1.0, 0.0, 0.0));
        missed += u32::from(!(sum.lower..=sum.upper).contains(&1.0));
    }
    // 6.1 %; 7.1 % with the lower end of the bias by likelihood ratios. One standard error is 0.08 %.
    assert!(missed * 1000 < runs * 65, "{missed} of {runs}");
}

#[test]
fn a_bias_found_by_chance_leaves_the_lower_end_to_noise() {
    let noise = ErrorEstimate { relmse: 1.0, lower: 0.9, upper: 1.1 };
    for error in [1.0, 10.0, 1e3] {
        for found in [0.0, 1.0, 2.4, 3.0, 3.9] {
            let sum = noise.with_bias(BiasEstimate::from_moments(found * error, error * error, 0.0, 0.0));
            assert!(sum.lower <= noise.relmse, "{found} standard errors of {error}: {sum:?}");
            assert!(sum.upper >= noise.upper + found * error);
        }
        // Twenty standard errors are not chance.
        let sum = noise.with_bias(BiasEstimate::from_moments(20.0 * error, error * error, 0.0, 0.0));
        assert!(sum.lower > 15.0 * error, "{sum:?}");
    }
}

#[test]
fn the_interval_holds_the_bias() {
    // 10 % too bright: 0.2² / (2² + 0.01 · 2²).
    let truth = 0.04 / 4.04;
    let (mut held, mut sum, runs) = (0, 0.0, 200);
    for seed in 0..runs {
        let bias = estimate(&findings(64, 0.2, seed));
        held += u32::from((bias.lower..=bias.upper).contains(&truth));
        sum += bias.relmse;
    }
    // The noise of a denominator enlarges its inverse by three times its relative variance, 3 %; the rest is
    // chance.
    let mean = sum / f64::from(runs);
    assert!((0.93..1.13).contains(&(mean / truth)), "{mean} {truth}");
    // 95 % of 200 are 190; fewer than 180 have a chance of 0.2 %.
    assert!(held >= 180, "{held} of {runs}");
}

#[test]
fn intervals_hold_what_is_nothing_or_something() {
    for truth in [0.0f64, 0.1, 0.3, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 3.0, 5.0] {
        // Simpson's rule would miss the ends; a step of a thousandth is as precise as they are.
        let held = |x: &f64| {
            let [lower, upper] = confidence_interval(3.0 * x, 3.0);
            (lower..=upper).contains(&(3.0 * truth))
        };
        let density = |x: f64| (-0.5 * (x - truth).powi(2)).exp() / core::f64::consts::TAU.sqrt();
        let share: f64 = (-8000..12000).map(|i| f64::from(i) * 1e-3).filter(held).map(density).sum();
        assert!((share * 1e-3 - 0.955).abs() < 0.008, "{truth}: {share}");
    }
    assert!(confidence_interval(-30.0, 1.0)[1] > 0.0);
}

#[test]
fn a_leak_does_not_hide_behind_its_own_brightness() {
    let (picture, truth) = (pixel(40.0, 8, Random::new(0, 0)), pixel(2.0, 400, Random::new(0, 1)));
    let finding = PixelBias::of(&picture, &truth, Rgb::splat(40.0), 2.0).unwrap();
    // (40 − 2)² over (40 / 4)² instead of 40².
    assert!(finding.bias > 14.0 && finding.deviation > 3.5, "{finding:?}");
}

#[test]
fn too_little_to_say_anything() {
    assert!(BiasEstimate::of([].into_iter()).is_none());
    let truth = pixel(2.0, 3, Random::new(0, 1));
    assert!(PixelBias::of(&pixel(2.0, 8, Random::new(0, 0)), &truth, Rgb::ONE, 1.0).is_none());
}
