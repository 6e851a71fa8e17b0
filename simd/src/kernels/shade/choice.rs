//! Choice of one of eight groups at each vertex of a block, in proportion to their weights. The remainder of
//! the number that chooses is rescaled, for the choice within the group.

use super::Row;
use crate::lanes::{Lanes, Mask, Simd};
use crate::level::{Kernel, Level};

/// Number of groups.
pub const GROUPS: usize = 8;

/// Largest f32 below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Prefix sums of weights that are not negative, in ascending order. A sum exceeds the previous sum if its
/// weight is not zero and survives rounding; a weight of zero leaves the sum unchanged.
#[inline(always)]
pub fn ends<L: Lanes>([a, b, c, d, e, f, g, h]: [L; GROUPS]) -> [L; GROUPS] {
    let two = a + b;
    let four = two + (c + d);
    let six = four + (e + f);
    [a, two, two + c, four, four + e, six, six + g, six + g + h]
}

/// Chosen groups over lanes.
#[derive(Clone, Copy)]
pub struct ChoiceLanes<L: Lanes> {
    /// Numbers of the groups.
    pub group: L,
    /// Probabilities of the choices.
    pub probability: L,
    /// Remainders of the numbers, rescaled to [0, 1).
    pub rest: L,
    /// Lanes with a weight above zero.
    pub exists: L::Mask,
}

/// Chooses by numbers `u` in [0, 1). Weights are finite and not negative.
#[inline(always)]
pub fn choose<L: Lanes>(weights: [L; GROUPS], u: L) -> ChoiceLanes<L> {
    let (zero, one) = (u.all(0.0), u.all(1.0));
    let ends = ends(weights);
    let sum = ends[GROUPS - 1];
    let wanted = u * sum;
    let (mut group, mut before, mut weight) = (zero, zero, weights[0]);
    let mut k = 1;
    let mut number = one;
    while k < GROUPS {
        let is_beyond = ends[k - 1].le(wanted);
        group = number.select(is_beyond, group);
        before = ends[k - 1].select(is_beyond, before);
        weight = weights[k].select(is_beyond, weight);
        (k, number) = (k + 1, number + one);
    }
    // No weight is above zero, or rounding exceeds the last that is.
    let is_last = sum.le(wanted);
    let mut exists = !is_last;
    if is_last.any() {
        let (mut k, mut number, mut end) = (0, zero, zero);
        while k < GROUPS {
            let counts = is_last & zero.lt(weights[k]);
            group = number.select(counts, group);
            before = end.select(counts, before);
            weight = weights[k].select(counts, weight);
            exists = exists | counts;
            (end, number) = (ends[k], number + one);
            k += 1;
        }
    }
    let rest = ((wanted - before) / weight).max(zero).min(u.all(BELOW_ONE));
    ChoiceLanes { group, probability: weight / sum, rest, exists }
}

/// Weights and numbers of a block.
#[derive(Debug)]
pub struct Choices<'b> {
    /// Weights of the groups, for each vertex.
    pub weights: &'b [[f32; GROUPS]; 16],
    /// Numbers in [0, 1).
    pub u: &'b Row,
}

/// Chosen groups of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct ChoiceBlock {
    /// Numbers of the groups.
    pub group: Row,
    /// Probabilities of the choices.
    pub probability: Row,
    /// Remainders of the numbers.
    pub rest: Row,
    /// Bit `i`: vertex `i` has a group.
    pub exists: u32,
}

impl ChoiceBlock {
    /// No groups.
    pub const EMPTY: Self = Self { group: [0.0; 16], probability: [0.0; 16], rest: [0.0; 16], exists: 0 };
}

impl Choices<'_> {
    /// Groups by the instructions of `level`, into `block`.
    pub fn compute(&self, level: Level, block: &mut ChoiceBlock) {
        level.dispatch((self, block));
    }

    /// Groups by the lanes of `simd`, into `block`, in a kernel of the caller.
    #[inline(always)]
    pub fn in_lanes<S: Simd>(&self, simd: S, block: &mut ChoiceBlock) {
        let chosen = choose(simd.columns16(self.weights), simd.load16(self.u));
        block.group = chosen.group.to_array();
        block.probability = chosen.probability.to_array();
        block.rest = chosen.rest.to_array();
        block.exists = chosen.exists.bits();
    }
}

impl Kernel for (&Choices<'_>, &mut ChoiceBlock) {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.0.in_lanes(simd, self.1);
    }
}

#[cfg(test)]
mod tests {
    use super::super::numbers::{mix, unit_float};
    use super::*;

    /// Weights with zeros, also at both ends or everywhere, and of very different sizes.
    fn weights(round: u64) -> [[f32; GROUPS]; 16] {
        let number = |k: u64| unit_float((mix(round << 16 | k) >> 32) as u32);
        core::array::from_fn(|i| {
            let kept = mix(round << 8 | i as u64);
            core::array::from_fn(|k| {
                let size = if kept >> (8 + k) & 1 == 1 { 1e-8 } else { 1.0 };
                if kept >> k & 1 == 1 || i == 5 { 0.0 } else { size * number((8 * i + k) as u64) }
            })
        })
    }

    #[test]
    fn groups_are_chosen_by_the_interval_of_the_number() {
        for round in 0..400 {
            let weights = weights(round);
            let u = core::array::from_fn(|i| match i {
                0 => 0.0,
                1 => BELOW_ONE,
                _ => unit_float((mix(round << 24 | i as u64) >> 32) as u32),
            });
            let mut wanted = ChoiceBlock::EMPTY;
            Choices { weights: &weights, u: &u }.compute(Level::SCALAR, &mut wanted);
            for i in 0..16 {
                let positive = weights[i].iter().any(|weight| *weight > 0.0);
                assert_eq!(wanted.exists >> i & 1 == 1, positive);
                if !positive {
                    continue;
                }
                let group = wanted.group[i] as usize;
                let (ends, weight) = (ends(weights[i]), weights[i][group]);
                assert!(weight > 0.0);
                assert_eq!(wanted.probability[i], weight / ends[GROUPS - 1]);
                let before = if group == 0 { 0.0 } else { ends[group - 1] };
                let target = u[i] * ends[GROUPS - 1];
                assert!(before <= target, "{before} {target}");
                assert!(target < ends[group] || weights[i][group + 1..].iter().all(|weight| *weight == 0.0));
                assert!((0.0..1.0).contains(&wanted.rest[i]));
            }
            for level in Level::detect().and_below() {
                let mut found = ChoiceBlock::EMPTY;
                Choices { weights: &weights, u: &u }.compute(level, &mut found);
                assert_eq!(found.exists, wanted.exists, "{level:?}");
                for i in (0..16).filter(|i| wanted.exists >> i & 1 == 1) {
                    let all = |block: &ChoiceBlock| {
                        [block.group[i], block.probability[i], block.rest[i]].map(f32::to_bits)
                    };
                    assert_eq!(all(&found), all(&wanted), "{level:?} {i}");
                }
            }
        }
    }
}
