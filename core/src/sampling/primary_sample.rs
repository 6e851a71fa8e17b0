//! Mutations of primary sample space (Kelemen et al. 2002). The random numbers of a light path are a point of
//! the unit cube, and a Markov chain moves that point.
//!
//! A large step draws all numbers anew. A small step changes each number by a distance between s / 64 and s,
//! uniformly distributed on a logarithmic scale, up or down with equal probability, and wraps at the ends of
//! the unit interval. Both are as likely as their reverse, so that the acceptance probability is min(1, f(v)
//! / f(u)).
//!
//! Departure from the paper: s is drawn for each small step, log-uniformly from 1/512 to 1/8. No fixed size
//! suits both large and small emitters.
//!
//! A third kind of step draws some numbers anew and keeps the others, for instance a tail of a subpath. It is
//! as likely as its reverse if the choice of the numbers does not depend on their values.
//!
//! A mutation is determined by its key and number.

use super::{ONE_MINUS_EPSILON, Random};

/// Largest change of a number by a small step.
const LARGEST: f32 = 0.125;

/// Range of step sizes, and of changes within a step, in octaves.
const OCTAVES: f32 = 6.0;

/// Range of changes of wide slots, in octaves.
const WIDE_OCTAVES: f32 = 1.0;

/// Counters of the step's own random numbers, far above the slots of points.
const SIZE: u32 = u32::MAX;
const KIND: u32 = u32::MAX - 1;
const ACCEPTANCE: u32 = u32::MAX - 2;
const CHOICE: u32 = u32::MAX - 3;

/// Step from a point of primary sample space.
#[derive(Clone, Copy, Debug)]
pub struct Mutation {
    random: Random,
}

impl Mutation {
    /// Step `number` of the chain with `key`.
    pub fn new(key: u32, number: u32) -> Self {
        Self { random: Random::new(key, number) }
    }

    /// Number in [0, 1) that decides the kind of step.
    pub fn kind(&self) -> f32 {
        self.random.single(KIND)
    }

    /// Two numbers in [0, 1) that decide which numbers of a point are drawn anew.
    pub fn choice(&self) -> [f32; 2] {
        [self.random.single(CHOICE), self.random.single(CHOICE - 1)]
    }

    /// Number in [0, 1) that decides the acceptance of the proposal.
    pub fn acceptance(&self) -> f32 {
        self.random.single(ACCEPTANCE)
    }

    /// Random numbers of the step by the slots of a point, also for numbers that the point does not store.
    pub fn random(&self) -> Random {
        self.random
    }

    /// Draws the numbers for which `is_new` anew, in [0, 1), and copies the others.
    pub fn renew(&self, point: &[f32], proposal: &mut [f32], is_new: impl Fn(usize) -> bool) {
        for (slot, (proposed, u)) in proposal.iter_mut().zip(point).enumerate() {
            *proposed = if is_new(slot) { self.random.single(slot as u32) } else { *u };
        }
    }

    /// Small step. The first `wide` slots change by at least half the size of the step.
    pub fn perturb(&self, point: &[f32], proposal: &mut [f32], wide: usize) {
        let slots = proposal.iter_mut().zip(0..);
        let size = LARGEST * power_of_two(-OCTAVES * self.random.single(SIZE));
        for ((proposed, slot), u) in slots.zip(point) {
            let bits = self.random.bits(slot);
            let chance = (bits >> 8) as f32 * (1.0 / (1u32 << 24) as f32);
            let octaves = if (slot as usize) < wide { WIDE_OCTAVES } else { OCTAVES };
            let change = size * power_of_two(-octaves * chance);
            // The lowest bit is not part of `chance`.
            let moved = if bits & 1 == 0 { u + change } else { u - change };
            let wrapped = moved + f32::from(u8::from(moved < 0.0)) - f32::from(u8::from(moved >= 1.0));
            *proposed = wrapped.clamp(0.0, ONE_MINUS_EPSILON);
        }
    }
}

/// Approximation of 2^x for x in [-64, 0] within 0.02 %, enough for the size of a step.
fn power_of_two(x: f32) -> f32 {
    let whole = (x + 64.0) as i32 - 64;
    let rest = x - whole as f32;
    let mantissa = 1.0 + rest * (0.695_556_9 + rest * (0.226_173_2 + rest * 0.078_269_9));
    f32::from_bits(((whole + 127) << 23) as u32) * mantissa
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Proposal for `u` in slot `slot` of a small step.
    fn small(key: u32, number: u32, u: f32, slot: usize) -> f32 {
        let mut proposal = [0.0; 8];
        Mutation::new(key, number).perturb(&[u; 8], &mut proposal, 0);
        proposal[slot]
    }

    #[test]
    fn small_steps_go_up_as_often_as_down_and_stay_in_the_unit_interval() {
        let (mut up, mut sum) = (0, 0.0);
        for number in 0..20_000 {
            let moved = small(5, number, 0.5, 7);
            let change = (moved - 0.5).abs();
            assert!(change > 0.0 && change <= LARGEST && (0.0..1.0).contains(&small(5, number, 0.0, 7)));
            up += i32::from(moved > 0.5);
            sum += f64::from(moved - 0.5);
        }
        // Within 4 standard deviations.
        assert!((up - 10_000).abs() < 4 * 71, "{up}");
        assert!((sum / 20_000.0).abs() < 4.0 * f64::from(LARGEST) / 4.0 / 141.0, "{sum}");
    }

    #[test]
    fn changes_are_spread_evenly_over_their_logarithm() {
        let mut octaves = [0u32; 12];
        for number in 0..20_000 {
            let change = (small(9, number, 0.5, 3) - 0.5).abs() / LARGEST;
            octaves[(-change.log2()).clamp(0.0, 11.9) as usize] += 1;
        }
        // The sum of two uniform distributions over six octaves: a triangle.
        for (octave, &count) in octaves.iter().enumerate() {
            let expected = 20_000.0 / 36.0 * (6.0 - (octave as f64 - 5.5).abs());
            assert!((f64::from(count) - expected).abs() < 5.0 * expected.sqrt() + 5.0, "{octaves:?}");
        }
    }

    #[test]
    fn a_chain_that_accepts_all_steps_is_uniform() {
        // Chi-squared with 15 degrees of freedom over independent chains; 37.7 is the 0.1 % level.
        let mut bins = [0u32; 16];
        for chain in 0..4000 {
            let mut point = [0.3, 0.99];
            for step in 0..80 {
                let mut proposal = [0.0; 2];
                let mutation = Mutation::new(chain, step);
                match step {
                    0..40 => mutation.renew(&point, &mut proposal, |_| true),
                    _ => mutation.perturb(&point, &mut proposal, 1),
                }
                point = proposal;
            }
            bins[(point[1] * 16.0) as usize] += 1;
        }
        let chi: f64 = bins.iter().map(|&n| (f64::from(n) - 250.0).powi(2) / 250.0).sum();
        assert!(chi < 37.7, "{chi}");
    }

    #[test]
    fn a_renewal_keeps_the_other_numbers() {
        let (point, mut proposal) = ([0.25, 0.5, 0.75], [0.0; 3]);
        Mutation::new(3, 9).renew(&point, &mut proposal, |slot| slot == 1);
        assert!(proposal[0] == 0.25 && proposal[1] != 0.5 && proposal[2] == 0.75);
    }

    #[test]
    fn the_power_of_two_is_near() {
        for i in 0..=1200 {
            let x = -i as f32 / 100.0;
            assert!((power_of_two(x) / x.exp2() - 1.0).abs() < 3e-4, "{x}");
        }
    }
}
