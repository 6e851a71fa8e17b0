//! Sizes of a sample of Metropolis light transport.

use crate::film::Splat;
use crate::memory::Footprint;
use crate::transport::metropolis::chain::{ChainsOutput, room};
use crate::transport::metropolis::lanes::LANES;

/// One of this number of points that are evaluated for a sample is independent.
const INDEPENDENT: usize = 4;

/// Chains that a sample has at least, while each has [`SHORTEST`] mutations; and mutations of a chain.
const FEWEST_CHAINS: usize = 64;
const SHORTEST: usize = 16;
pub(super) const LONGEST: usize = 256;

/// Independent points of a sample at least.
const FEWEST_CANDIDATES: usize = 64;

/// Sizes of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Plan {
    pub(super) candidates: usize,
    pub(super) chains: usize,
    pub(super) mutations: usize,
}

impl Plan {
    /// For `budget` points.
    pub(super) fn new(budget: usize) -> Self {
        let visits = budget - budget / INDEPENDENT;
        let mutations = (visits / FEWEST_CHAINS).clamp(SHORTEST, LONGEST);
        let chains = visits.div_ceil(mutations).max(1);
        Self { candidates: (budget / INDEPENDENT).max(FEWEST_CANDIDATES), chains, mutations }
    }

    pub(super) fn tasks(&self) -> usize {
        self.chains.div_ceil(LANES)
    }

    pub(super) fn footprint(&self) -> Footprint {
        Footprint::default()
            .slice::<f32>(self.candidates)
            .slice::<u32>(self.chains)
            .slice::<Splat>(self.tasks() * room(self.mutations))
            .slice::<ChainsOutput>(self.tasks())
    }

    /// Points of all kinds.
    pub(super) fn points(&self) -> usize {
        self.candidates + self.chains * self.mutations
    }

    /// With no more than that number of points, and one chain at least.
    pub(super) fn at_most(self, points: usize) -> Self {
        if self.points() <= points {
            return self;
        }
        let candidates = (points / INDEPENDENT).max(FEWEST_CANDIDATES);
        let chains = (points.saturating_sub(candidates) / self.mutations).max(1);
        Self { candidates: candidates.min(self.candidates), chains: chains.min(self.chains), ..self }
    }

    /// As large as `bytes` allow, with one task at least.
    pub(super) fn within(self, bytes: usize) -> Self {
        let mut plan = self;
        while plan.footprint().bytes() > bytes && plan.tasks() > 1 {
            plan.chains = (plan.tasks() - 1) * LANES;
            plan.candidates = plan.candidates.min((plan.chains * plan.mutations).div_ceil(INDEPENDENT - 1));
        }
        plan
    }
}
