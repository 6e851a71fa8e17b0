//! Noise of other counts of techniques, predicted from samples with the counts of a pilot (Grittmann et al.
//! 2022).
//!
//! With the balance heuristic a sample brings v = f / Σ n p, whatever technique has found it. With counts
//! n′ it would bring v / r, where r = Σ w n′ / n and w is the share of a technique in the sum. Samples with
//! counts n give the second moment for all n′ at once:
//!
//! E′ [Σ v′²] = E [Σ v² / r].
//!
//! Light that n′ finds seldom counts as much as it will in the long run, although a pilot with n′ would not
//! see it.

use crate::method::tuned::{CONNECTION, LIGHT_PATH_WEIGHTS, LIGHT_RAY, PHOTON, SHADOW_RAY};
use crate::transport::bidirectional::contribution::{CLASSES, Class, Contribution, Rest};
use bytemuck::{Pod, Zeroable};

/// Classes whose counts are chosen.
pub const CHOSEN: [Class; 3] = [Class::Splats, Class::Connections, Class::Merges];

/// Least r: rounding of the shares. Light that is found less often is as good as not found.
const LEAST: f32 = 1e-6;

/// Numbers of techniques of a sample of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Light paths for each pixel.
    pub light_paths: f32,
    /// Connections of a camera vertex.
    pub connections: u32,
    /// True if vertices are merged.
    pub merging: bool,
}

/// Light paths of candidates for each pixel, and their connections.
const LIGHT_PATHS: [f32; 4] = [0.25, 0.5, 1.0, 2.0];
const CONNECTIONS: [u32; 4] = [0, 1, 2, 4];

/// Light paths for each pixel where vertices are merged, at least.
const LEAST_FOR_MERGING: f32 = 1.0;

/// Number of candidates.
pub const CANDIDATES: usize = 1 + 2 * LIGHT_PATHS.len() * CONNECTIONS.len();

/// Counts that are not to be chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Given {
    /// See [`Candidate`].
    pub light_paths: Option<f32>,
    /// See [`Candidate`].
    pub connections: Option<u32>,
    /// See [`Candidate`].
    pub merging: Option<bool>,
}

impl Candidate {
    /// Path tracing.
    pub const PATHS: Self = Self { light_paths: 0.0, connections: 0, merging: false };

    /// All candidates that have the counts `given`, some of them more than once. The first is path tracing
    /// in any case; without light paths there is nothing to connect or merge, and with few of them discs
    /// are noisy.
    pub fn all(given: &Given) -> [Self; CANDIDATES] {
        let mut all = [Self::PATHS; CANDIDATES];
        for (i, candidate) in all[1..].iter_mut().enumerate() {
            let (merging, light_paths, connections) = (i % 2 == 1, i / 2 % 4, i / 8);
            let merging = given.merging.unwrap_or(merging);
            let least = if merging { LEAST_FOR_MERGING } else { 0.0 };
            let light_paths = LIGHT_PATHS[light_paths].max(least);
            *candidate = Self {
                light_paths: given.light_paths.unwrap_or(light_paths),
                connections: given.connections.unwrap_or(CONNECTIONS[connections]),
                merging,
            };
        }
        all
    }

    /// n′ / n of each class, where `self` has n′ and `pilot` has n, all of them above zero.
    pub fn ratios(&self, pilot: &Self) -> [f32; CLASSES] {
        let light_paths = self.light_paths / pilot.light_paths;
        let connections = self.connections as f32 / pilot.connections as f32;
        [1.0, light_paths, connections, if self.merging { light_paths } else { 0.0 }]
    }
}

/// A contribution with the shares of all classes in the denominator of its weight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Weighed {
    contribution: Contribution,
    shares: [f32; CLASSES],
}

/// A contribution as other counts would have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reweighted {
    /// Expected value of the samples with n′ for each of those with n.
    pub value: f32,
    /// Expected sum of their squares.
    pub square: f32,
    /// Their expected number.
    pub likelihood: f32,
}

impl Weighed {
    /// A `contribution`, and the values of the same sample where the weights count one of the [`CHOSEN`]
    /// classes twice. Its share is what this adds to the denominator.
    pub fn new(contribution: Contribution, doubled: [f32; CHOSEN.len()]) -> Self {
        let mut shares = [0.0; CLASSES];
        for (class, doubled) in CHOSEN.into_iter().zip(doubled) {
            let own = if contribution.class() == class { 2.0 } else { 1.0 };
            let share = own * contribution.value / doubled - 1.0;
            shares[class as usize] = if share > 0.0 { share.min(1.0) } else { 0.0 };
        }
        shares[Class::Paths as usize] = (1.0 - shares.iter().sum::<f32>()).max(0.0);
        Self { contribution, shares }
    }

    /// Pixel of the tile.
    pub fn place(&self) -> usize {
        self.contribution.place()
    }

    /// Records that do not supply the light.
    pub fn rest(&self) -> Rest {
        self.contribution.rest()
    }

    /// Value with the counts of the pilot.
    pub fn value(&self) -> f32 {
        self.contribution.value
    }

    /// True if it is the light of the photons around a vertex.
    pub fn is_merge(&self) -> bool {
        self.contribution.class() == Class::Merges
    }

    /// With other counts, whose `ratios` are those of [`Candidate::ratios`].
    pub fn with(&self, ratios: &[f32; CLASSES]) -> Reweighted {
        let sum: f32 = self.shares.iter().zip(ratios).map(|(share, ratio)| share * ratio).sum();
        let likelihood = sum.max(LEAST);
        let reweighted = self.value() / likelihood;
        let own = ratios[self.contribution.class() as usize];
        Reweighted { value: reweighted * own, square: self.value() * reweighted, likelihood }
    }
}

/// Work of a pilot for each pixel and sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Rays of camera paths.
    pub camera_rays: f32,
    /// Shadow rays of light samples.
    pub light_samples: f32,
    /// Shadow rays of one connection of each vertex.
    pub connections: f32,
    /// Rays of one light path.
    pub light_rays: f32,
    /// Shadow rays of its splats.
    pub splats: f32,
}

impl Work {
    /// Work of a sample of a pixel with these counts, in rays of camera paths.
    pub fn of(&self, candidate: &Candidate) -> f32 {
        let paths = self.camera_rays + SHADOW_RAY * self.light_samples;
        if candidate.light_paths == 0.0 {
            return paths;
        }
        let photons = if candidate.merging { PHOTON } else { 0.0 };
        let light_path = (LIGHT_RAY + photons) * self.light_rays + SHADOW_RAY * self.splats;
        let connections = CONNECTION * candidate.connections as f32 * self.connections;
        LIGHT_PATH_WEIGHTS * paths + connections + candidate.light_paths * light_path
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;
    use std::vec;
    use std::vec::Vec;

    /// An integrand on [0, 1), and the densities of four techniques.
    fn integrand(x: f64) -> f64 {
        (if x < 0.02 { 40.0 } else { 0.5 }) + 3.0 * x.powi(6)
    }

    const EXPONENTS: [f64; CLASSES] = [0.0, 3.0, -0.6, 8.0];

    fn pdf(class: usize, x: f64) -> f64 {
        (1.0 + EXPONENTS[class]) * x.powf(EXPONENTS[class])
    }

    fn denominator(counts: &[f64; CLASSES], x: f64) -> f64 {
        (0..CLASSES).map(|class| counts[class] * pdf(class, x)).sum()
    }

    /// ∫ f² / Σ n p: the second moment of samples with these counts.
    fn second_moment(counts: &[f64; CLASSES]) -> f64 {
        const STEPS: usize = 100_000;
        (0..STEPS)
            .map(|i| (i as f64 + 0.5) / STEPS as f64)
            .map(|x| integrand(x).powi(2) / denominator(counts, x) / STEPS as f64)
            .sum()
    }

    const PILOT: Candidate = Candidate { light_paths: 0.5, connections: 2, merging: true };
    const COUNTS: [f64; CLASSES] = [1.0, 1.5, 0.5, 0.7];

    const ROUNDS: u32 = 50_000;

    /// Samples of the pilot, with the shares by doubled counts.
    fn samples() -> Vec<Weighed> {
        let mut samples = vec![];
        for (class, technique) in
            [Class::Paths, Class::Splats, Class::Connections, Class::Merges].into_iter().enumerate()
        {
            let random = Random::new(7, class as u32);
            for i in 0..(COUNTS[class] * f64::from(ROUNDS)) as u32 {
                let x = f64::from(random.single(i)).max(1e-9).powf(1.0 / (1.0 + EXPONENTS[class]));
                let value = |counts: &[f64; CLASSES]| {
                    (integrand(x) / denominator(counts, x) * counts[class] / COUNTS[class]) as f32
                };
                let doubled = CHOSEN.map(|class| {
                    let mut counts = COUNTS;
                    counts[class as usize] *= 2.0;
                    value(&counts)
                });
                samples.push(Weighed::new(Contribution::new(technique, 3, value(&COUNTS)), doubled));
            }
        }
        samples
    }

    #[test]
    fn shares_are_those_of_the_denominator() {
        let mut sums = [0.0; 2];
        for weighed in samples() {
            assert!((weighed.shares.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            assert_eq!(weighed.place(), 3);
            // A technique is used as often as its share says.
            sums[0] += f64::from(weighed.shares[Class::Splats as usize]);
            sums[1] += f64::from(u32::from(weighed.contribution.class() == Class::Splats));
        }
        assert!((sums[0] - sums[1]).abs() < 0.01 * f64::from(ROUNDS), "{sums:?}");
    }

    #[test]
    fn moments_of_all_candidates_follow_from_one_pilot() {
        let integral: f64 = (0..100_000).map(|i| integrand((f64::from(i) + 0.5) / 1e5) / 1e5).sum();
        let samples = samples();
        for candidate in Candidate::all(&Given::default()) {
            let ratios = candidate.ratios(&PILOT);
            let (mut value, mut square) = (0.0, 0.0);
            for weighed in &samples {
                let Reweighted { value: v, square: s, .. } = weighed.with(&ratios);
                (value, square) = (value + f64::from(v), square + f64::from(s));
            }
            let mut counts = COUNTS;
            counts.iter_mut().zip(ratios).for_each(|(count, ratio)| *count *= f64::from(ratio));
            let expected = second_moment(&counts);
            let (value, square) = (value / f64::from(ROUNDS), square / f64::from(ROUNDS));
            assert!((value / integral - 1.0).abs() < 0.02, "{candidate:?}: {value} {integral}");
            assert!((square / expected - 1.0).abs() < 0.03, "{candidate:?}: {square} {expected}");
        }
    }

    #[test]
    fn light_that_no_technique_finds_is_noise_without_end() {
        // Merges alone find it.
        let contribution = Contribution::new(Class::Merges, 0, 2.0);
        let weighed = Weighed::new(contribution, [2.0, 2.0, 2.0]);
        assert_eq!(weighed.shares, [0.0, 0.0, 0.0, 1.0]);
        assert!(weighed.with(&Candidate::PATHS.ratios(&PILOT)).square >= 1e6);
        let same = Reweighted { value: 2.0, square: 4.0, likelihood: 1.0 };
        assert_eq!(weighed.with(&PILOT.ratios(&PILOT)), same);
    }

    #[test]
    fn work_grows_with_every_count() {
        let work =
            Work { camera_rays: 4.0, light_samples: 2.0, connections: 2.0, light_rays: 2.0, splats: 1.0 };
        let all = Candidate::all(&Given::default());
        assert_eq!(all.iter().filter(|other| **other == Candidate::PATHS).count(), 1);
        for (a, b) in all.iter().flat_map(|a| all.iter().map(move |b| (a, b))) {
            let less = a.light_paths <= b.light_paths && a.connections <= b.connections;
            if less && a.merging <= b.merging && a != b {
                assert!(work.of(a) < work.of(b), "{a:?} {b:?}");
            }
        }
    }
}
