//! What a cache lacks for the error that was asked for. Its bias, that the audit tells, and the noise of its records do
//! not vanish with samples; where they are what is left, records have to be closer to each other, or to have more rays.

use super::rounds::{FEWEST_FOR_BIAS, FEWEST_FOR_ERROR};
use super::{Audited, ErrorEstimate};
use serde::{Deserialize, Serialize};

/// The next refinement comes when the samples of before are so small a part of the picture.
const PATIENCE: u32 = 3;

/// The share of the error asked for that the bias may have, and that samples may leave however many there are.
const MOST: f64 = 0.5;

/// How a cache is refined.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Refinement {
    /// Factor of the radii of its records.
    pub(super) share: f32,
    /// Whether there are twice as many strata along a side of what is gathered.
    pub(super) is_finer: bool,
}

/// By how much an error is out of reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shortfall {
    /// The squared bias over what it may be, where it is more.
    pub(super) bias: Option<f64>,
    /// Whether noise stays that more samples do not take away.
    pub(super) noise: bool,
}

/// What was refined so far, and what is known since. It follows from samples and estimates alone, not from the clock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Refinements {
    pub(super) made: Vec<Refinement>,
    /// Samples at the last of them.
    at: u32,
    /// Samples, and the relMSE of noise, to which the next estimates are compared.
    base: Option<(u32, f64)>,
}

impl Refinements {
    /// Whether samples of before the last one are too many to tell what it brought.
    pub(super) fn are_young(&self, spp: u32) -> bool {
        spp < PATIENCE * self.at
    }

    /// Takes note of one.
    pub(super) fn add(&mut self, refinement: Refinement, spp: u32) {
        self.made.push(refinement);
        (self.at, self.base) = (spp, None);
    }

    /// What keeps the error `wanted` out of reach, after `spp` samples, as far as they tell. Noise that falls as a + b/n
    /// has the floor a, which shows when samples have doubled.
    pub(super) fn shortfall(
        &mut self,
        wanted: f64,
        spp: u32,
        noise: ErrorEstimate,
        audited: Option<&Audited>,
    ) -> Option<Shortfall> {
        if spp < FEWEST_FOR_ERROR || self.are_young(spp) {
            return None;
        }
        let audited = audited.filter(|audited| audited.samples >= FEWEST_FOR_BIAS);
        // A refinement for nothing costs less than samples that bring nothing; but if chance cannot be ruled out, a small one.
        let bias = audited.map(|audited| audited.bias).filter(|bias| bias.relmse > MOST * wanted);
        let bias = bias.map(|bias| if bias.is_found() { bias.relmse / (MOST * wanted) } else { 1.0 });
        let (before, was) = *self.base.get_or_insert((spp, noise.relmse));
        let mut floor = 0.0;
        if spp >= 2 * before {
            let [n, m] = [before, spp].map(f64::from);
            floor = (noise.relmse * m - was * n) / (m - n);
            self.base = Some((spp, noise.relmse));
        }
        let noise = floor > MOST * wanted;
        (bias.is_some() || noise).then_some(Shortfall { bias, noise })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(relmse: f64) -> ErrorEstimate {
        ErrorEstimate { relmse, lower: relmse, upper: relmse }
    }

    #[test]
    fn a_floor_of_noise_is_found_and_a_slope_is_none() {
        for (floor, wanted) in [(0.0, false), (4e-4, false), (6e-4, true)] {
            let mut refinements = Refinements::default();
            let mut found = false;
            for spp in [4, 8, 16, 24, 32, 64] {
                let error = noise(floor + 1.0 / f64::from(spp));
                found |= refinements.shortfall(1e-3, spp, error, None).is_some();
            }
            assert_eq!(found, wanted, "{floor}");
        }
    }

    #[test]
    fn it_waits_until_old_samples_are_few() {
        let mut refinements = Refinements::default();
        refinements.add(Refinement { share: 0.5, is_finer: false }, 32);
        assert!(refinements.are_young(95) && !refinements.are_young(96));
        for spp in [32, 64, 95, 96, 191] {
            assert_eq!(refinements.shortfall(1e-3, spp, noise(1.0), None), None);
        }
        assert!(refinements.shortfall(1e-3, 192, noise(1.0), None).is_some_and(|short| short.noise));
    }
}
