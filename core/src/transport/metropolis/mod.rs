//! Metropolis light transport in primary sample space: Markov chains over the random numbers of paths
//! (Kelemen et al. 2002), one technique of a bidirectional path tracer at a time (Hachisuka et al. 2014), and
//! the path tracer that leaves to them the light that it finds badly (Bitterli and Jarosz 2019).
//!
//! [`target`] evaluates points of primary sample space, a batch together; [`bootstrap`] draws independent
//! points, the candidates of chains; [`chain`] runs chains; [`paths`] is the path tracer beside them;
//! [`split`] says which part of a path's light belongs to whom.

pub mod bootstrap;
pub mod chain;
mod lane;
pub mod lanes;
mod light_subpath;
pub(in crate::transport) mod numbers;
pub mod paths;
pub mod split;
pub mod target;
mod technique;

#[cfg(test)]
mod tests;
