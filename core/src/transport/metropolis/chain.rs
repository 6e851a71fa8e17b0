//! Markov chains in primary sample space, all of a task in lockstep, so that the tracer sees batches of rays.

use super::bootstrap::Bootstrap;
use super::lanes::{LANES, Lanes};
use super::numbers::{NUMBERS, Point, Source};
use super::target::{Step, Value};
use crate::Rgb;
use crate::bsdf::Features;
use crate::film::{Splat, StripOffsets, sort_by_strip};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::{Mutation, mix};
use crate::transport::settings::Counters;
use bytemuck::{Pod, Zeroable};

/// Probability of a large step. Chains start anew for each sample of the picture, so that few are needed.
const LARGE_STEPS: f32 = 0.05;

/// Probability of a step that draws a part of one subpath anew.
const SUBPATH_STEPS: f32 = 0.35;

/// The kind of a mutation.
fn kind(mutation: &Mutation) -> Step {
    match mutation.kind() {
        u if u < LARGE_STEPS => Step::Large,
        u if u < LARGE_STEPS + SUBPATH_STEPS => Step::Subpath,
        _ => Step::Small,
    }
}

/// Distinguishes the numbers of chains from others.
const SEED: u64 = 0x6d75_7461_7469_6f6e;

/// Splats of a task whose chains have `mutations`: one of each mutation, and one of each last state.
pub const fn room(mutations: usize) -> usize {
    LANES * (mutations + 1)
}

/// Proposals of one kind, and those that were accepted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Steps {
    /// Proposals.
    pub proposed: u32,
    /// Those accepted.
    pub accepted: u32,
}

/// The outcome of a task beside its splats.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct ChainsOutput {
    /// Small steps, large steps, steps of a subpath.
    pub steps: [Steps; 3],
    /// The splats of each strip in the task's list.
    pub offsets: StripOffsets,
}

/// A chain between two mutations.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Chain {
    value: Value,
    density: f32,
    /// Expected number of mutations after which the chain was in this state.
    weight: f32,
    segments: u32,
    /// Seed of its random numbers.
    key: u32,
}

/// Runs the chains of a sample of the picture.
#[derive(Clone, Copy)]
pub struct Chains<'a, F> {
    bootstrap: Bootstrap<'a, F>,
    seed: u32,
    sample: u32,
    pixels: usize,
    /// Mutations of a chain.
    mutations: u32,
    /// Radiance of a pixel for each visit of a chain.
    scale: f32,
}

impl<'a, F: Features> Chains<'a, F> {
    /// Chains of `mutations` that start from points of `bootstrap`, for a film of `pixels`; `scale` is the
    /// radiance that one visit of density 1 brings to a pixel.
    pub fn new(
        bootstrap: Bootstrap<'a, F>,
        (seed, sample): (u32, u32),
        pixels: usize,
        mutations: u32,
        scale: f32,
    ) -> Self {
        Self { bootstrap, seed, sample, pixels, mutations, scale }
    }

    /// Working memory of a task.
    pub fn scratch(mutations: usize) -> Footprint {
        Bootstrap::<F>::scratch()
            .slice::<f32>(LANES * NUMBERS)
            .slice::<Value>(LANES)
            .slice::<Chain>(LANES)
            .slice::<Splat>(room(mutations))
    }

    /// Runs the chains of `task` from the candidates `starts`, up to [`LANES`]; their splats, sorted by
    /// strips, go into `splats`, which has [`room`] for all.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`Chains::scratch`].
    #[inline(never)]
    pub fn run(
        &self,
        task: usize,
        starts: &[u32],
        scratch: &mut Arena,
        splats: &mut [Splat],
        output: &mut ChainsOutput,
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut lanes = Lanes::new(&mut arena)?;
        let current: &mut [f32] = arena.slice(LANES * NUMBERS)?;
        let values: &mut [Value] = &mut arena.slice(LANES)?[..starts.len()];
        let proposed: &mut [f32] = arena.slice(LANES * NUMBERS)?;
        let chains: &mut [Chain] = &mut arena.slice(LANES)?[..starts.len()];
        let mut list = List { splats: arena.slice(room(self.mutations as usize))?, count: 0 };
        let mut counters = Counters::default();
        let Self { bootstrap, mutations, scale, .. } = *self;
        let target = bootstrap.target;

        bootstrap.evaluate(|lane| starts[lane], current, &mut lanes, values, &mut counters);
        let seed = mix(SEED ^ u64::from(self.seed)).wrapping_add(u64::from(self.sample) << 32);
        for (lane, (chain, value)) in chains.iter_mut().zip(&*values).enumerate() {
            *chain = Chain {
                value: *value,
                density: target.density(value),
                weight: 0.0,
                segments: bootstrap.length(starts[lane]).0,
                key: mix(seed.wrapping_add((task * LANES + lane) as u64)) as u32,
            };
        }
        let mut steps = [Steps::default(); 3];
        for number in 0..mutations {
            let mutation = |chain: &Chain| Mutation::new(chain.key, number);
            let numbers = current.chunks(NUMBERS).zip(proposed.chunks_mut(NUMBERS));
            for (chain, (from, to)) in chains.iter().zip(numbers) {
                let (slots, mutation) = (target.slots(chain.segments), mutation(chain));
                let (from, to) = (&from[..slots], &mut to[..slots]);
                target.propose(kind(&mutation), &mutation, chain.segments, from, to);
            }
            let point = |lane: usize| {
                let chain = &chains[lane];
                let numbers = &proposed[lane * NUMBERS..][..target.slots(chain.segments)];
                (Point { numbers, source: Source::Mutation(mutation(chain).random()) }, chain.segments)
            };
            target.evaluate(&mut lanes, point, values, &mut counters);
            for (lane, (chain, value)) in chains.iter_mut().zip(&*values).enumerate() {
                let mutation = mutation(chain);
                let density = target.density(value);
                let steps = &mut steps[kind(&mutation) as usize];
                steps.proposed += 1;
                let acceptance = if density < chain.density { density / chain.density } else { 1.0 };
                chain.weight += 1.0 - acceptance;
                let proposal = Chain { value: *value, density, weight: acceptance, ..*chain };
                if acceptance > 0.0 && mutation.acceptance() < acceptance {
                    steps.accepted += 1;
                    list.push(chain, scale);
                    *chain = proposal;
                    let at = lane * NUMBERS..lane * NUMBERS + target.slots(chain.segments);
                    current[at.clone()].copy_from_slice(&proposed[at]);
                } else {
                    list.push(&proposal, scale);
                }
            }
        }
        chains.iter().for_each(|chain| list.push(chain, scale));
        let offsets = sort_by_strip(&list.splats[..list.count], self.pixels, splats);
        *output = ChainsOutput { steps, offsets };
        Ok(counters)
    }
}

/// Splats of a task.
struct List<'s> {
    splats: &'s mut [Splat],
    count: usize,
}

impl List<'_> {
    /// Adds the light that a chain brings while it is in one state.
    fn push(&mut self, chain: &Chain, scale: f32) {
        if chain.weight > 0.0
            && chain.density > 0.0
            && let Some(slot) = self.splats.get_mut(self.count)
        {
            let radiance = Rgb::from(chain.value.radiance) * (scale * chain.weight / chain.density);
            *slot = Splat { pixel: chain.value.pixel, radiance: radiance.to_array() };
            self.count += 1;
        }
    }
}
