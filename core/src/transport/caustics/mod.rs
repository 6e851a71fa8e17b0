//! Caustics by vertex merging (Georgiev et al. 2012): photons through mirrors and dielectrics, joined with
//! paths.

pub(in crate::transport) mod merge;
pub mod tracer;
