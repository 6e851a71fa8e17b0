//! Synthetic pictures: the estimated error against the true one, for several kinds of noise and of truth.

use super::fit::View;
use super::scale::{Scale, Shape};
use super::tests::Threads;
use super::*;
use crate::memory::{Arena, Line};
use crate::method::Loop;
use crate::sampling::Random;
use std::vec;
use std::vec::Vec;

const SIDE: usize = 96;
const SIZE: [usize; 2] = [SIDE, SIDE];
const PIXELS: usize = SIDE * SIDE;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Noise {
    White,
    /// Shared by the pixels of a group in a block of 8 × 8.
    Circles,
    /// Shared by all pixels of such a block.
    Blocks,
    Fireflies,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Truth {
    Smooth,
    AlignedEdge,
    UnknownEdge,
    Texture,
}

/// Light of a pixel, and its surfaces.
fn truth(truth: Truth, [x, y]: [usize; 2]) -> (f32, PixelSurfaces) {
    let (u, v) = (x as f32 / SIDE as f32, y as f32 / SIDE as f32);
    let smooth = 0.6 + 0.8 * u + 0.5 * (2.0 * v).sin();
    let slope = x as f32 + 0.4 * y as f32 - 60.0;
    let covered = (slope + 0.5).clamp(0.0, 1.0);
    let plain = PixelSurfaces::default();
    match truth {
        Truth::Smooth => (smooth, plain),
        Truth::UnknownEdge => (smooth * (1.0 - 0.7 * covered), plain),
        Truth::Texture => (smooth * (1.0 + 0.4 * (x as f32 * 1.3).sin() * (y as f32 * 0.9).cos()), plain),
        Truth::AlignedEdge => {
            let light = smooth * (1.0 - 0.7 * covered);
            let (first, rest) = if covered > 0.5 { (1, covered) } else { (0, 1.0 - covered) };
            let others = if rest < 1.0 { 1 - first } else { NO_CLUSTER };
            let clusters = [first, others, NO_CLUSTER, NO_CLUSTER];
            (light, PixelSurfaces { clusters, fractions: [rest, 1.0 - rest, 0.0, 0.0], ..plain })
        }
    }
}

/// One of two groups of a pixel, at random.
fn group([x, y]: [usize; 2]) -> u8 {
    (crate::sampling::mix((y * SIDE + x) as u64 + 1) >> 20 & 1) as u8
}

struct Picture {
    values: Vec<Both>,
    truth: Vec<f32>,
    surfaces: Vec<PixelSurfaces>,
    groups: Vec<u8>,
    is_shared: bool,
}

/// Picture with relative noise `amount` in each half, of which the fraction `common` is common to both.
fn picture(kind: Truth, noise: Noise, amount: f32, common: f32, seed: u32) -> Picture {
    let place = |i: usize| [i % SIDE, i / SIDE];
    let (truth, surfaces): (Vec<_>, Vec<_>) = (0..PIXELS).map(|i| truth(kind, place(i))).unzip();
    let groups: Vec<_> = (0..PIXELS).map(|i| group(place(i))).collect();
    let of = |source: usize, channel: u32, half: u32| {
        let random = Random::new(seed, source as u32 * 8 + channel);
        // Nearly normal.
        let uniform = |k: u32| random.single(4 * half + k) - 0.5;
        (uniform(0) + uniform(1) + uniform(2) + uniform(3)) * 1.732
    };
    let value = |i: usize| -> Both {
        let [x, y] = place(i);
        let block = (y / 8 * SIDE.div_ceil(8) + x / 8) * 2 + usize::from(groups[i]);
        core::array::from_fn(|c| {
            let (channel, half) = ((c % 3) as u32, (c / 3) as u32);
            let own = of(i, channel, half);
            let own = (1.0 - common).sqrt() * own + common.sqrt() * of(i, channel, 2);
            let noise = match noise {
                Noise::White => own,
                Noise::Circles => 0.7 * own + 0.7 * of(PIXELS + block, channel, half),
                Noise::Blocks => 0.7 * own + 0.7 * of(PIXELS + block / 2 * 2, channel, half),
                Noise::Fireflies => {
                    let lot = Random::new(!seed, i as u32).single(half);
                    own + if lot < 1e-3 { 40.0 } else { -0.04 }
                }
            };
            truth[i] * (1.0 + amount * noise)
        })
    };
    Picture { values: (0..PIXELS).map(value).collect(), truth, surfaces, groups, is_shared: false }
}

impl Picture {
    fn halves(&self) -> Halves<'_> {
        let Self { values, surfaces, groups, is_shared, .. } = self;
        Halves { size: SIZE, values, parts: [0.5; 2], groups, surfaces, is_shared: *is_shared }
    }

    /// Weight of a squared error by the truth.
    fn weight(&self, i: usize) -> f64 {
        1.0 / (f64::from(self.truth[i]).powi(2) + 0.01)
    }

    /// True error of a picture and its estimate, with true weights.
    fn errors(&self, of: &[Both]) -> [f64; 2] {
        let (mut found, mut estimated) = (0.0, 0.0);
        for (i, (value, raw)) in of.iter().zip(&self.values).enumerate() {
            let weight = [self.weight(i) as f32; 3];
            let sum = error::of_pixel(value, raw, &weight, 0.25);
            estimated += sum.noise + sum.bias;
            for c in 0..3 {
                let off = f64::from(0.5 * (value[c] + value[3 + c]) - self.truth[i]);
                found += off * off * self.weight(i);
            }
        }
        [found, estimated].map(|sum| sum / (3 * PIXELS) as f64)
    }
}

/// Runs `work` on a reconstruction of `picture`.
fn reconstructed<T>(picture: &Picture, work: impl FnOnce(&Reconstruction, Reconstructed) -> T) -> T {
    let mut lines = vec![Line::ZERO; Reconstruction::footprint(SIZE).bytes() / 64];
    let mut memory = Reconstruction::new(SIZE, &mut Arena::over(&mut lines)).unwrap();
    let result = memory.run(&picture.halves(), &mut Loop::new(&mut [])).unwrap();
    work(&memory, result)
}

/// Mean error, its estimate, and the standard error of their difference, over pictures; raw error.
fn statistics(kind: Truth, noise: Noise, common: f32) -> ([f64; 2], f64, f64) {
    statistics_of(|seed| picture(kind, noise, 0.1, common, seed))
}

/// As [`statistics`], of the pictures by seed.
fn statistics_of(picture: impl Fn(u32) -> Picture) -> ([f64; 2], f64, f64) {
    let (mut sums, mut square, mut of_raw) = ([0.0; 2], 0.0, 0.0);
    for seed in 0..SEEDS {
        let picture = picture(seed);
        let [found, estimated] = reconstructed(&picture, |memory, _| picture.errors(memory.halves()));
        sums = [sums[0] + found, sums[1] + estimated];
        square += (found - estimated).powi(2);
        of_raw += picture.errors(&picture.values)[0];
    }
    let count = f64::from(SEEDS);
    (sums.map(|sum| sum / count), square.sqrt() / count, of_raw / count)
}

/// Pictures of a test.
const SEEDS: u32 = 24;

/// Chance differences of so many standard errors have a probability below 0.3 %.
const CHANCE: f64 = 3.0;

#[test]
fn the_halves_know_the_error() {
    // The strengths know a little of the noise of pixels around.
    const TOLERANCE: f64 = 0.03;
    for kind in [Truth::Smooth, Truth::AlignedEdge, Truth::UnknownEdge, Truth::Texture] {
        for noise in [Noise::White, Noise::Circles, Noise::Fireflies] {
            let ([found, estimated], chance, raw) = statistics(kind, noise, 0.0);
            let off = (estimated - found).abs();
            assert!(off < TOLERANCE * found + CHANCE * chance, "{kind:?} {noise:?}: {estimated} {found}");
            assert!(found < 1.02 * raw, "{kind:?} {noise:?}: {found} {raw}");
            // Circles of sixteen pixels leave little to gain; fireflies make the coefficients of steps
            // uncertain, so that the finer picture wins.
            let least = match noise {
                Noise::Circles => 5.0,
                Noise::Fireflies => 12.0,
                _ => 20.0,
            };
            let is_smooth = matches!(kind, Truth::Smooth | Truth::AlignedEdge);
            assert!(!is_smooth || raw > least * found, "{kind:?} {noise:?}: {found} {raw}");
        }
    }
}

#[test]
fn light_of_fireflies_is_spread_and_not_lost() {
    // Fits stay in the range of the light of their pixels.
    const TOLERANCE: f64 = 3e-3;
    for kind in [Truth::Smooth, Truth::AlignedEdge, Truth::UnknownEdge] {
        let (mut light, mut fireflies, mut left) = ([0.0; 2], 0.0, 0.0);
        for seed in 0..SEEDS / 3 {
            let picture = picture(kind, Noise::Fireflies, 0.1, 0.0, seed);
            let sum = |of: &[Both]| of.iter().flatten().map(|light| f64::from(*light)).sum::<f64>();
            // Fireflies have five times the light of their pixel.
            let far_above = |of: &[Both]| {
                let pixels = of.iter().zip(&picture.truth);
                pixels.filter(|(value, truth)| value.iter().any(|light| *light > 2.5 * **truth)).count()
                    as f64
            };
            let kept = reconstructed(&picture, |memory, _| memory.halves().to_vec());
            light = [light[0] + sum(&kept), light[1] + sum(&picture.values)];
            fireflies += far_above(&picture.values);
            left += far_above(&kept);
        }
        assert!((light[0] / light[1] - 1.0).abs() < TOLERANCE, "{kind:?}: {light:?}");
        // The last step puts some back.
        assert!(fireflies > 100.0 && left < 0.25 * fireflies, "{kind:?}: {left} of {fireflies}");
    }
}

#[test]
fn noise_that_halves_share_is_not_known() {
    let ([found, estimated], chance, _) = statistics(Truth::Texture, Noise::White, 0.3);
    assert!(estimated < 0.9 * found - CHANCE * chance, "{estimated} {found}");
}

#[test]
fn strengths_need_groups_without_common_noise() {
    let ([found, estimated], chance, _) = statistics(Truth::Smooth, Noise::Blocks, 0.0);
    assert!(estimated < found - CHANCE * chance, "{estimated} {found}");
}

#[test]
fn pixels_further_away_judge_those_that_share_noise() {
    const TOLERANCE: f64 = 0.05;
    for kind in [Truth::AlignedEdge, Truth::Texture] {
        let shared = |seed| Picture { is_shared: true, ..picture(kind, Noise::Blocks, 0.1, 0.0, seed) };
        let ([found, estimated], chance, raw) = statistics_of(shared);
        let off = (estimated - found).abs();
        assert!(off < TOLERANCE * found + CHANCE * chance, "{kind:?}: {estimated} {found}");
        assert!(found < raw, "{kind:?}: {found} {raw}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let picture = picture(Truth::AlignedEdge, Noise::Fireflies, 0.1, 0.0, 1);
    let bits = |executor: &mut Threads| {
        let mut lines = vec![Line::ZERO; Reconstruction::footprint(SIZE).bytes() / 64];
        let mut memory = Reconstruction::new(SIZE, &mut Arena::over(&mut lines)).unwrap();
        let result = memory.run(&picture.halves(), executor).unwrap();
        (memory.halves().to_vec(), result)
    };
    assert!(bits(&mut Threads(1)) == bits(&mut Threads(7)));
}

#[test]
fn footprint_is_exact() {
    let mut lines = vec![Line::ZERO; Reconstruction::footprint([50, 33]).bytes() / 64];
    assert!(Reconstruction::new([50, 33], &mut Arena::over(&mut lines)).is_ok());
    lines.pop();
    assert!(Reconstruction::new([50, 33], &mut Arena::over(&mut lines)).is_err());
}

#[test]
fn polynomials_on_masks_with_holes_are_reproduced() {
    // The ridge takes this part of the slopes.
    const TOLERANCE: f32 = 1e-3;
    for (side, degree) in [(48, 2), (24, 2), (12, 1), (6, 1)] {
        let plain = PixelSurfaces::default();
        let mixed = PixelSurfaces { fractions: [0.5, 0.0, 0.0, 0.0], ..plain };
        let is_hole = |i: usize| crate::sampling::mix(i as u64 + 9).is_multiple_of(3);
        let surfaces: Vec<_> = (0..PIXELS).map(|i| if is_hole(i) { mixed } else { plain }).collect();
        let light = |i: usize| {
            let (x, y) = ((i % SIDE) as f32 / SIDE as f32, (i / SIDE) as f32 / SIDE as f32);
            let square = if degree == 2 { x * x - 2.0 * x * y + 0.5 * y * y } else { 0.0 };
            1.0 + x - 0.5 * y + square
        };
        // Mixed pixels are in no fit.
        let value = |i: usize| if is_hole(i) { [99.0; VALUES] } else { [light(i); VALUES] };
        let values: Vec<Both> = (0..PIXELS).map(value).collect();
        let whole: Vec<_> = surfaces.iter().map(PixelSurfaces::whole).collect();
        let shape = Shape { side, degree, slots: 2 };
        let mut lines = vec![Line::ZERO; Scale::footprint(SIZE, shape).bytes() / 64];
        let mut scale = Scale::new(SIZE, shape, &mut Arena::over(&mut lines)).unwrap();
        let view = View { width: SIDE, height: SIDE, values: &values, surfaces: &surfaces, whole: &whole };
        scale.fit(view, &mut Loop::new(&mut []));
        for i in (0..PIXELS).filter(|i| !is_hole(*i)) {
            let found = scale.light(&plain, [i % SIDE, i / SIDE]).unwrap();
            assert!(found.iter().all(|found| (found - light(i)).abs() < TOLERANCE), "{side}: {i} {found:?}");
        }
    }
}
