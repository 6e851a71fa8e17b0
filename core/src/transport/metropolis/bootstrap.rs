//! Independent points, of which chains start (Veach 1997, section 11.3.1): their mean density is the
//! brightness of the picture, and a chain that starts from a point drawn in proportion to its density has no
//! start-up bias.

use super::lanes::{LANES, Lanes};
use super::numbers::{NUMBERS, Point, Source};
use super::split::MAX_SEGMENTS;
use super::target::{Target, Value};
use crate::bsdf::Features;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::{Random, Sampler, mix};
use crate::transport::settings::Counters;

/// Points of a task.
pub const CANDIDATES: usize = 4 * LANES;

/// Distinguishes the numbers of points from those of pixels.
const SEED: u64 = 0x6d65_7472_6f70_6f6c;

/// Dimension of the choice of a length.
const LENGTH: u32 = 1 << 19;

/// The share of points that is spread evenly over all lengths.
const EVENLY: f64 = 0.1;

/// A distribution over numbers of segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lengths {
    first: u32,
    count: u32,
    chances: [f32; MAX_SEGMENTS as usize],
}

impl Lengths {
    /// In proportion to `weight` of each number of segments, and a tenth evenly.
    pub fn new(range: core::ops::RangeInclusive<u32>, weight: impl Fn(u32) -> f64) -> Self {
        let (first, last) = range.into_inner();
        let count = (last + 1).saturating_sub(first).clamp(1, MAX_SEGMENTS);
        let total: f64 = (first..first + count).map(&weight).sum();
        let even = 1.0 / f64::from(count);
        let mut chances = [0.0; MAX_SEGMENTS as usize];
        for (segments, chance) in (first..first + count).zip(&mut chances) {
            let share = if total > 0.0 { weight(segments) / total } else { even };
            *chance = (EVENLY * even + (1.0 - EVENLY) * share) as f32;
        }
        Self { first, count, chances }
    }

    /// The number of segments that `u` in [0, 1) chooses, and its probability.
    pub(super) fn choose(&self, mut u: f32) -> (u32, f32) {
        for (segments, &chance) in (self.first..).zip(&self.chances[..self.count as usize]) {
            if u < chance {
                return (segments, chance);
            }
            u -= chance;
        }
        (self.first, self.chances[0])
    }

    /// The fewest segments.
    pub fn first(&self) -> u32 {
        self.first
    }
}

/// Draws the points of a sample of the picture.
#[derive(Clone, Copy)]
pub struct Bootstrap<'a, F> {
    pub(super) target: Target<'a, F>,
    pub(super) lengths: Lengths,
    seed: u32,
    sample: u32,
}

impl<'a, F: Features> Bootstrap<'a, F> {
    /// Points for `sample` of the picture of `seed`.
    pub fn new(target: Target<'a, F>, lengths: Lengths, seed: u32, sample: u32) -> Self {
        let seed = mix(SEED ^ u64::from(seed)) as u32;
        Self { target, lengths, seed, sample }
    }

    /// Working memory of a task.
    pub fn scratch() -> Footprint {
        Lanes::footprint().slice::<f32>(LANES * NUMBERS).slice::<Value>(LANES)
    }

    fn sampler(&self, candidate: u32) -> Sampler {
        Sampler::replicate(self.seed, self.sample >> 1, self.sample & 1, candidate)
    }

    /// The length of paths of a candidate, and its probability.
    pub fn length(&self, candidate: u32) -> (u32, f32) {
        self.lengths.choose(self.sampler(candidate).single(LENGTH))
    }

    /// Writes the numbers of a candidate.
    pub(super) fn fill(&self, candidate: u32, numbers: &mut [f32]) {
        let sampler = self.sampler(candidate);
        for (pair, dimension) in numbers.chunks_mut(2).zip(0..) {
            pair.iter_mut().zip(sampler.pair(dimension)).for_each(|(slot, u)| *slot = u);
        }
    }

    /// Evaluates up to [`LANES`] candidates, whose numbers it writes.
    pub(super) fn evaluate(
        &self,
        candidates: impl Fn(usize) -> u32,
        numbers: &mut [f32],
        lanes: &mut Lanes,
        values: &mut [Value],
        counters: &mut Counters,
    ) {
        let mut lengths = [0; LANES];
        let rows = numbers.chunks_mut(NUMBERS).zip(&mut lengths).take(values.len());
        for (lane, (numbers, segments)) in rows.enumerate() {
            let candidate = candidates(lane);
            *segments = self.length(candidate).0;
            self.fill(candidate, &mut numbers[..self.target.slots(*segments)]);
        }
        let numbers = &*numbers;
        let point = |lane: usize| {
            let (candidate, segments) = (candidates(lane), lengths[lane]);
            let numbers = &numbers[lane * NUMBERS..][..self.target.slots(segments)];
            (Point { numbers, source: Source::Sequence(self.sampler(candidate)) }, segments)
        };
        self.target.evaluate(lanes, point, values, counters);
    }

    /// Writes the densities of the candidates of a task, each over the probability of its length.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`Bootstrap::scratch`].
    #[inline(never)]
    pub fn run(
        &self,
        task: usize,
        scratch: &mut Arena,
        densities: &mut [f32],
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut lanes = Lanes::new(&mut arena)?;
        let numbers = arena.slice(LANES * NUMBERS)?;
        let values: &mut [Value] = arena.slice(LANES)?;
        let mut counters = Counters::default();
        for (batch, densities) in densities.chunks_mut(LANES).enumerate() {
            let first = task * CANDIDATES + batch * LANES;
            let values = &mut values[..densities.len()];
            let candidate = |lane: usize| (first + lane) as u32;
            self.evaluate(candidate, numbers, &mut lanes, values, &mut counters);
            for (lane, (density, value)) in densities.iter_mut().zip(values).enumerate() {
                *density = self.target.density(value) / self.length(candidate(lane)).1;
            }
        }
        Ok(counters)
    }

    /// Chooses the starts of chains among the candidates in proportion to `densities`, by one stratified
    /// number. Returns the mean density; with 0 no start was chosen.
    pub fn choose(&self, densities: &[f32], starts: &mut [u32]) -> f64 {
        let total: f64 = densities.iter().map(|&density| f64::from(density)).sum();
        if !(total > 0.0 && total.is_finite()) {
            return 0.0;
        }
        let random = Random::new(self.seed, self.sample).single(u32::MAX);
        let step = total / starts.len() as f64;
        let mut candidates = densities.iter().zip(0..).filter(|(density, _)| **density > 0.0);
        let (mut passed, mut candidate) = (0.0, 0);
        for (start, number) in starts.iter_mut().zip(0u32..) {
            let at = (f64::from(number) + f64::from(random)) * step;
            while passed <= at
                && let Some((&density, next)) = candidates.next()
            {
                passed += f64::from(density);
                candidate = next;
            }
            *start = candidate;
        }
        total / densities.len() as f64
    }
}
