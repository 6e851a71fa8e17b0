//! Mutations of primary sample space (Kelemen et al. 2002): a light path is a point of the unit cube, the
//! random numbers that make it, and a Markov chain moves that point.
//!
//! A large step draws all numbers anew. A small step changes each by a distance between s and s / 64,
//! distributed evenly over its logarithm, up or down alike and around the ends of the unit interval. Both are
//! as likely as their reverse, so that a proposal is accepted with min(1, f(v) / f(u)).
//!
//! A departure from the paper: s is not fixed, but drawn for each small step from 1/512 to 1/8, evenly over
//! its logarithm. No single size suits a large lamp and a small one.
//!
//! A mutation follows from its key and number alone, and nothing is stored until it is accepted.

use super::{Numbers, ONE_MINUS_EPSILON, Random};

/// The largest change of a number by a small step.
const LARGEST: f32 = 0.125;

/// The range of step sizes, and of changes within a step, as a binary logarithm.
const OCTAVES: f32 = 6.0;

/// One step from a point of primary sample space.
#[derive(Clone, Copy, Debug)]
pub struct Mutation {
    random: Random,
    /// The largest change, in (0, [`LARGEST`]]; `None` for a large step.
    size: Option<f32>,
}

impl Mutation {
    /// Small step `number` of the chain with `key`.
    pub fn small_step(key: u32, number: u32) -> Self {
        let random = Random::new(key, number);
        let size = LARGEST * libm::exp2f(-OCTAVES * random.single(u32::MAX));
        Self { random, size: Some(size) }
    }

    /// Large step `number` of the chain with `key`: no number depends on the one before.
    pub fn large_step(key: u32, number: u32) -> Self {
        Self { random: Random::new(key, number), size: None }
    }

    /// The proposed number in [0, 1) for number `slot` of the point, which is `u`.
    #[inline]
    pub fn mutate(&self, u: f32, slot: u32) -> f32 {
        let Some(size) = self.size else { return self.draw(slot) };
        let chance = 2.0 * self.random.single(slot);
        let (chance, sign) = if chance < 1.0 { (chance, 1.0) } else { (chance - 1.0, -1.0) };
        let moved = u + sign * size * libm::exp2f(-OCTAVES * chance);
        (moved - libm::floorf(moved)).min(ONE_MINUS_EPSILON)
    }

    /// A number that depends on no other one.
    #[inline]
    fn draw(&self, slot: u32) -> f32 {
        self.random.single(slot)
    }

    /// Makes the proposal the new point. Slots 2 d and 2 d + 1 of `point` are the numbers of dimension d.
    pub fn accept(&self, point: &mut [f32]) {
        point.iter_mut().zip(0..).for_each(|(u, slot)| *u = self.mutate(*u, slot));
    }
}

/// The random numbers of a proposal: those of `point`, mutated. Dimensions beyond the end of `point` are
/// drawn anew.
#[derive(Clone, Copy, Debug)]
pub struct MutatedSample<'p> {
    /// Two numbers for each dimension, as [`Mutation::accept`] has them.
    pub point: &'p [f32],
    /// The step.
    pub mutation: Mutation,
}

impl MutatedSample<'_> {
    #[inline]
    fn slot(&self, slot: u32) -> f32 {
        let u = self.point.get(slot as usize);
        u.map_or_else(|| self.mutation.draw(slot), |&u| self.mutation.mutate(u, slot))
    }
}

impl Numbers for MutatedSample<'_> {
    #[inline]
    fn single(&self, dimension: u32) -> f32 {
        self.slot(dimension.wrapping_mul(2))
    }

    #[inline]
    fn pair(&self, dimension: u32) -> [f32; 2] {
        let first = dimension.wrapping_mul(2);
        [self.slot(first), self.slot(first.wrapping_add(1))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_steps_go_up_as_often_as_down_and_stay_in_the_unit_interval() {
        let (mut up, mut sum) = (0, 0.0);
        for number in 0..20_000 {
            let step = Mutation::small_step(5, number);
            let moved = step.mutate(0.5, 7);
            let change = (moved - 0.5).abs();
            assert!(change > 0.0 && change <= LARGEST && (0.0..1.0).contains(&step.mutate(0.0, 7)));
            up += i32::from(moved > 0.5);
            sum += f64::from(moved - 0.5);
        }
        // Within 4 standard deviations.
        assert!((up - 10_000).abs() < 4 * 71, "{up}");
        assert!((sum / 20_000.0).abs() < 4.0 * f64::from(LARGEST) / 4.0 / 141.0, "{sum}");
    }

    #[test]
    fn a_chain_that_accepts_all_steps_is_uniform() {
        // Chi-squared with 15 degrees of freedom over independent chains; 37.7 is the level of 0.1 %.
        let mut bins = [0u32; 16];
        for chain in 0..4000 {
            let mut point = [0.3, 0.99];
            (0..40).for_each(|step| Mutation::large_step(chain, step).accept(&mut point));
            (40..80).for_each(|step| Mutation::small_step(chain, step).accept(&mut point));
            bins[(point[1] * 16.0) as usize] += 1;
        }
        let chi: f64 = bins.iter().map(|&n| (f64::from(n) - 250.0).powi(2) / 250.0).sum();
        assert!(chi < 37.7, "{chi}");
    }

    #[test]
    fn a_proposal_is_the_point_that_its_acceptance_makes() {
        let mut point = [0.1, 0.2, 0.3, 0.4];
        for (number, mutation) in [Mutation::small_step(1, 0), Mutation::large_step(1, 1)].iter().enumerate()
        {
            let proposal = MutatedSample { point: &point, mutation: *mutation };
            let pairs = [proposal.pair(0), proposal.pair(1)];
            assert_eq!(proposal.single(1), pairs[1][0]);
            // Dimension 2 is not stored.
            let beyond = proposal.pair(2);
            assert!(beyond.iter().all(|u| (0.0..1.0).contains(u)), "{number}");
            mutation.accept(&mut point);
            assert_eq!(point.as_slice(), pairs.as_flattened());
        }
    }
}
