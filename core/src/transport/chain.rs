//! Light paths that change a little from one to the next, and stay where they leave photons that are seen: Metropolis
//! sampling of visible photons (Hachisuka and Jensen 2011, "Robust Adaptive Photon Tracing using Photon Path Visibility").
//!
//! Let u be the numbers of a light path, V(u) = 1 where it leaves a photon that is seen ([`Sight`]) and 0 elsewhere, f(u)
//! the seen photons that it leaves. A chain changes all numbers a little, both ways alike, and goes on from there where
//! V = 1; else it stays, and what it is counts once more. In the long run it is at every u with V(u) = 1 equally often, so
//! that
//!
//!   ∫ f du = b · E[f | V = 1], b = ∫ V du
//!
//! Of N paths by independent numbers, n are seen: b ≈ n / N, over *all* of them, those included that looked for a place to
//! start at. Chains start at one of these n, each equally likely. It is a draw from what the chain converges to, so
//! there is nothing to wait for: whatever n is, what a chain counts has the right mean, and b is multiplied by zero where
//! n = 0 and there is no chain. So every map has the right light in the mean, whatever paths its chains start from: its
//! own, and where too few of those are seen, those of some maps before.
//!
//! Photons that are not seen are left by the N paths alone. They leave seen ones, too: of light that both find, each has a share.
//!
//! Departures from the paper:
//! 1. Chains do not go on from map to map, and exchange nothing with independent paths on their way: starting from them
//!    is that exchange, once for each map. A map follows from its number and those of a few before, which rendering in
//!    parts asks for.
//! 2. The size of a change does not adapt to how many are taken, but is drawn anew for each, over all scales: what adapts
//!    depends on its past, and one size is not right for a large lamp and a small one.
//! 3. Photons that are counted several times are left once, with their power as many times.

use super::estimator::Counters;
use super::flight::{Flight, Onward, PATHS, Pile, Sequence, Source, State, Vertex, Visitor};
use super::shoot::{Keep, Leaver, Shooter};
use super::sight::Sight;
use crate::Rgb;
use crate::bsdf::Features;
use crate::light::EMISSION_DIMENSIONS;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::Photon;
use crate::sampling::{Numbers, ONE_MINUS_EPSILON, Random, Sampler, mix};
use bytemuck::{Pod, Zeroable};

/// Chains of a task, which advance together, at most and at least. They change as often as makes so many paths as other
/// tasks have: fewer chains are longer.
const MOST_CHAINS: usize = 128;
const FEWEST_CHAINS: usize = 16;

/// Vertices of which a chain keeps the numbers. Those further on are drawn anew with each change.
const VERTICES: u32 = 10;
const DIMENSIONS: usize = (EMISSION_DIMENSIONS + VERTICES * Leaver::DIMENSIONS) as usize;
/// Two for each dimension.
const SLOTS: usize = 2 * DIMENSIONS;

/// Photons that all chains of a task have at a time, at most.
const HELD: usize = 16 * MOST_CHAINS;

/// The largest change; the smallest of a step is so many octaves less, and steps shrink by up to so many.
const LARGEST: f32 = 0.125;
const OCTAVES: f32 = 6.0;

/// What light chains are for.
#[derive(Clone, Copy)]
pub struct Share<'a> {
    /// What is seen.
    pub sight: Sight<'a>,
    /// What independent paths keep of the light of seen photons, from 0 to 1.
    pub kept: f32,
}

/// A path of a map that left a photon that is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Start {
    /// Number of the map.
    pub map: u32,
    /// Number of the path.
    pub path: u32,
}

/// Where chains may begin.
#[derive(Clone, Copy)]
pub struct Starts<'a> {
    /// The paths that were seen.
    pub seen: &'a [Start],
    /// Of how many, all maps together.
    pub of: u64,
}

/// Chains that begin at paths of some maps.
#[derive(Clone, Copy)]
pub struct Chains<'a, F> {
    flight: Flight<'a, F>,
    tasks: usize,
    /// Of each task.
    chains: usize,
    share: Share<'a>,
    starts: &'a [Start],
    /// b, times what chains have of seen light.
    power: f32,
}

impl<'a, F: Features> Chains<'a, F> {
    /// In so many `tasks`, from paths of `shooter`.
    pub fn new(shooter: &Shooter<'a, F>, tasks: usize, share: Share<'a>, starts: Starts<'a>) -> Self {
        let flight = shooter.flight;
        let Starts { seen, of } = starts;
        // About two chains for each start: more would begin alike.
        let mut chains = MOST_CHAINS;
        while chains > FEWEST_CHAINS && chains * tasks > 2 * seen.len() {
            chains /= 2;
        }
        // A path of the flight carries its part of as many as it has.
        let visible = seen.len() as f64 / of.max(1) as f64;
        let part = f64::from(flight.paths) / (tasks * PATHS) as f64;
        let power = f64::from(1.0 - share.kept) * visible * part;
        Self { flight, tasks, chains, share, starts: seen, power: power as f32 }
    }

    /// Working memory of one task.
    pub fn scratch() -> Footprint {
        let numbers = Footprint::default().slice::<f32>(MOST_CHAINS * SLOTS).slice::<u32>(MOST_CHAINS);
        numbers.slice::<Left>(HELD).slice::<Left>(HELD).and(Shooter::<F>::scratch())
    }

    /// Lets the chains of task `task` of map number `map` run. All of `out` is written, as by [`Shooter::run`], and room
    /// for [`ROOM`](super::shoot::ROOM) photons is enough.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`Chains::scratch`] bytes.
    pub fn run(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [Photon],
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut pile = Pile::new(out);
        let mut counters = Counters::default();
        let chains = self.chains;
        let numbers = arena.slice::<f32>(chains * SLOTS)?;
        let counted = arena.slice::<u32>(chains)?;
        let mut now = Held { left: arena.slice::<Left>(HELD)?, count: 0 };
        let mut next = Held { left: arena.slice::<Left>(HELD)?, count: 0 };
        if self.starts.is_empty() {
            pile.finish();
            return Ok(counters);
        }
        let key = mix(SEED ^ u64::from(self.flight.seed)) as u32 ^ map.rotate_left(16);
        let step = 1.0 / (self.tasks * chains) as f64;
        let turned = f64::from(Random::new(key, u32::MAX).single(0));
        let first = ((task * chains) as f64 + turned) * step;
        let begin =
            Begin { sequence: |map| self.flight.sequence::<Leaver>(map), starts: self.starts, first, step };
        counters += self.follow(&begin, &mut arena, &mut now)?;
        counted.fill(0);
        for (chain, own) in numbers.chunks_exact_mut(SLOTS).enumerate() {
            let sampler = begin.of(chain as u32);
            for (dimension, slots) in own.chunks_exact_mut(2).enumerate() {
                slots.copy_from_slice(&sampler.pair(dimension as u32));
            }
        }
        for first in (0..PATHS).step_by(chains) {
            let first = (task * PATHS + first) as u32;
            let change = Change { numbers, key, first };
            next.count = 0;
            counters += self.follow(&change, &mut arena, &mut next)?;
            let mut seen = [false; MOST_CHAINS];
            next.as_slice().iter().for_each(|left| seen[usize::from(left.chain) % MOST_CHAINS] = true);
            now.leave(|chain| seen[chain % MOST_CHAINS], counted, self.power, &mut pile, &mut counters);
            for left in next.as_slice() {
                now.hold(*left, &mut counters);
            }
            let chains = seen.into_iter().zip(counted.iter_mut()).zip(numbers.chunks_exact_mut(SLOTS));
            for (chain, ((seen, counted), own)) in chains.enumerate() {
                *counted = if seen { 1 } else { *counted + 1 };
                if seen {
                    let move_by = Move::new(key, first + chain as u32);
                    own.iter_mut().enumerate().for_each(|(slot, u)| *u = move_by.moved(*u, slot as u32));
                }
            }
        }
        now.leave(|_| true, counted, self.power, &mut pile, &mut counters);
        pile.finish();
        Ok(counters)
    }

    /// One path for each chain.
    fn follow<S: Source>(
        &self,
        source: &S,
        arena: &mut Arena,
        held: &mut Held,
    ) -> Result<Counters, OutOfMemory> {
        let mut watcher = Watcher { sight: self.share.sight, held };
        self.flight.follow_all(source, (0, self.chains), arena, &mut watcher)
    }
}

/// Distinguishes the random numbers of changes from all others.
const SEED: u64 = 0x6368_6169_6e73_2121;

/// A photon of a chain.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, packed(2))]
struct Left {
    photon: Photon,
    chain: u16,
}

/// Photons of all chains, in no order.
struct Held<'m> {
    left: &'m mut [Left],
    count: usize,
}

impl Held<'_> {
    fn as_slice(&self) -> &[Left] {
        self.left.get(..self.count).unwrap_or_default()
    }

    fn hold(&mut self, left: Left, counters: &mut Counters) {
        match self.left.get_mut(self.count) {
            Some(slot) => {
                *slot = left;
                self.count += 1;
            }
            None => counters.dropped.unfinished += 1,
        }
    }

    /// Leaves those of the chains that `ends` says on the pile, as often as `counted`, and forgets them.
    fn leave(
        &mut self,
        ends: impl Fn(usize) -> bool,
        counted: &[u32],
        power: f32,
        pile: &mut Pile,
        counters: &mut Counters,
    ) {
        let mut kept = 0;
        for i in 0..self.count {
            let Some(left) = self.left.get(i).copied() else { continue };
            let chain = usize::from(left.chain);
            if !ends(chain) {
                if let Some(slot) = self.left.get_mut(kept) {
                    *slot = left;
                    kept += 1;
                }
                continue;
            }
            let times = counted.get(chain).copied().unwrap_or(0);
            if times > 0 {
                pile.leave(left.photon.times(power * times as f32), counters);
            }
        }
        self.count = kept;
    }
}

/// Keeps seen photons.
struct Watcher<'w, 'm> {
    sight: Sight<'w>,
    held: &'w mut Held<'m>,
}

impl Visitor for Watcher<'_, '_> {
    const SEED: u64 = Leaver::SEED;

    #[inline]
    fn meet(&mut self, state: &State, vertex: &Vertex, counters: &mut Counters) -> Option<Onward> {
        let leaves = Keep::Reflected.leaves(state, vertex);
        if leaves && self.sight.shows(vertex.point.position, vertex.point.geometric_normal) {
            let photon = vertex.photon(Rgb::from(state.power));
            self.held.hold(Left { photon, chain: state.number as u16 }, counters);
        }
        Keep::Reflected.onward(vertex, leaves)
    }
}

/// Where chains begin: over all of them each of `starts` is as likely as any other.
struct Begin<'s, S> {
    /// The numbers of a map.
    sequence: S,
    starts: &'s [Start],
    /// Of the first chain, and from one to the next, in parts of all starts.
    first: f64,
    step: f64,
}

impl<S: Fn(u32) -> Sequence> Source for Begin<'_, S> {
    type Numbers = Sampler;

    fn of(&self, number: u32) -> Sampler {
        let at = (self.first + f64::from(number) * self.step) * self.starts.len() as f64;
        let at = (at as usize).min(self.starts.len().saturating_sub(1));
        let Start { map, path } = self.starts.get(at).copied().unwrap_or(Start { map: 0, path: 0 });
        (self.sequence)(map).of(path)
    }
}

/// One change of all chains.
struct Change<'c> {
    numbers: &'c [f32],
    key: u32,
    /// Number of the change of the first chain.
    first: u32,
}

impl<'c> Source for Change<'c> {
    type Numbers = Changed<'c>;

    fn of(&self, number: u32) -> Changed<'c> {
        let own = self.numbers.chunks_exact(SLOTS).nth(number as usize).unwrap_or_default();
        Changed { own, by: Move::new(self.key, self.first + number) }
    }
}

/// The numbers of a chain, changed.
struct Changed<'c> {
    own: &'c [f32],
    by: Move,
}

impl Changed<'_> {
    #[inline]
    fn slot(&self, slot: u32) -> f32 {
        self.own.get(slot as usize).map_or_else(|| self.by.anew(slot), |&u| self.by.moved(u, slot))
    }
}

impl Numbers for Changed<'_> {
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

/// How numbers change: as likely back as forth, around the end of the unit interval.
#[derive(Clone, Copy)]
struct Move {
    random: Random,
    /// The largest.
    size: f32,
}

impl Move {
    fn new(key: u32, number: u32) -> Self {
        let random = Random::new(key, number);
        Self { random, size: LARGEST * libm::exp2f(-OCTAVES * random.single(u32::MAX)) }
    }

    /// `u`, changed as number `slot`.
    #[inline]
    fn moved(&self, u: f32, slot: u32) -> f32 {
        let chance = 2.0 * self.random.single(slot);
        let (chance, sign) = if chance < 1.0 { (chance, 1.0) } else { (chance - 1.0, -1.0) };
        let moved = u + sign * self.size * libm::exp2f(-OCTAVES * chance);
        (moved - libm::floorf(moved)).min(ONE_MINUS_EPSILON)
    }

    /// Another number in its place.
    fn anew(&self, slot: u32) -> f32 {
        self.random.single(slot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_move_as_often_up_as_down_and_stay_in_the_unit_interval() {
        let (mut up, mut sum) = (0, 0.0);
        for number in 0..20_000 {
            let by = Move::new(5, number);
            let moved = by.moved(0.5, 7);
            let far = (moved - 0.5).abs();
            assert!(far > 0.0 && far <= LARGEST && (0.0..1.0).contains(&by.moved(0.0, 7)));
            up += i32::from(moved > 0.5);
            sum += f64::from(moved - 0.5);
        }
        // Within 4 standard deviations.
        assert!((up - 10_000).abs() < 4 * 71, "{up}");
        assert!((sum / 20_000.0).abs() < 4.0 * f64::from(LARGEST) / 4.0 / 141.0, "{sum}");
    }
}
