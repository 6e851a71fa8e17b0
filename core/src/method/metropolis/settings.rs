//! Choices of Metropolis light transport, and the use of its chains.

use super::PrimarySpace;
use crate::findings::Decision::{LeftOut, Used};
use crate::findings::{Finding, Value};

/// Choices of Metropolis light transport.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetropolisSettings {
    /// Kind of the points of chains.
    pub space: PrimarySpace,
    /// Points evaluated for each pixel of a sample, a quarter of them independent.
    pub mutations: u32,
    /// Largest contribution of path tracing relative to the rough brightness of a pixel; chains have the
    /// rest. 0 leaves all light to chains, except that of paths of fewer than 3 or more than 20 segments.
    pub threshold: f32,
}

impl MetropolisSettings {
    /// Usual choices.
    pub const DEFAULT: Self = Self { space: PrimarySpace::Multiplexed, mutations: 4, threshold: 2.0 };
}

impl Default for MetropolisSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Use of chains.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChainUse {
    /// Chains of a sample of the picture, and mutations of each.
    pub chains: u32,
    /// Mutations of each chain.
    pub mutations: u32,
    /// Independent points of a sample.
    pub candidates: u32,
    /// Shares of small steps, of large steps and of steps of a subpath that were accepted.
    pub accepted: [f64; 3],
    /// Light of chains over that of the picture, about.
    pub share: f64,
    /// Relative standard deviation of that share's mean over the samples; 0 of one sample.
    pub share_error: f64,
}

impl ChainUse {
    /// Finding on the chains.
    pub fn finding(&self) -> Finding {
        let (decision, reason) = match self.share {
            0.0 => (LeftOut, "path tracing finds all light well"),
            _ => (Used, "light that path tracing finds badly is found by Markov chains"),
        };
        let [small, large, subpath] = self.accepted;
        Finding::new("markov_chains", decision, reason)
            .with("chains", Value::Count(self.chains.into()))
            .with("mutations_per_chain", Value::Count(self.mutations.into()))
            .with("independent_points", Value::Count(self.candidates.into()))
            .with("accepted_small_steps", Value::Fraction(small))
            .with("accepted_large_steps", Value::Fraction(large))
            .with("accepted_subpath_steps", Value::Fraction(subpath))
            .with("share_of_light", Value::Fraction(self.share))
            .with("share_error", Value::Fraction(self.share_error))
    }
}
