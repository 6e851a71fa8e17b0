//! Bidirectional methods (Veach 1997, chapter 10; Davidovič et al. 2014): light paths whose vertices are
//! stored and splatted, camera paths whose vertices are connected to stored ones or merged with them.
//!
//! [`light_pass`] traces the light paths of a sample of the picture, [`camera_paths`] the camera paths of a
//! tile. Both carry the running sums of [`mis`]. How often each technique is used is a matter of
//! [`mis::Counts`]: without light paths the camera paths are path tracing, without connections both together
//! are light tracing beside path tracing.

mod arrival;
mod camera_path;
pub mod camera_paths;
pub mod contribution;
pub(in crate::transport) mod ends;
pub mod light_pass;
pub mod merge_photons;
mod merging;
pub mod mis;
pub mod reference;
mod scattering;
mod techniques;
pub mod vertex;
