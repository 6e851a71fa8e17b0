//! Bidirectional methods (Veach 1997, chapter 10; Davidovič et al. 2014; Georgiev et al. 2012). For each
//! sample of the picture, as in SmallVCM's `vertexcm.hxx`:
//!
//! 1. [`light_pass`] traces the light paths of the sample. Each vertex that is not specular is splatted to
//!    the camera and stored as a [`vertex::LightVertex`].
//! 2. A photon map of the stored vertices is built for merges ([`merge_photons`]).
//! 3. [`camera_paths`] traces the camera paths of a tile. At each vertex (`CameraPaths::step`) a path adds
//!    emission that it hits, merges with photons, a light sample, and connections to stored vertices; then it
//!    scatters.
//!
//! The loop over samples is `RenderMethod::round` in `method/bidirectional`. Both walks carry the running
//! sums of `walk/sums.rs`, which weight all techniques by [`Counts`]: without light paths the camera paths
//! are path tracing, without connections both together are light tracing.
//!
//! A vertex is a *caster* if its surface reflects or transmits in a narrow lobe
//! ([`Bsdf::is_caustic_caster`](crate::bsdf::Bsdf::is_caustic_caster)), and *rough* otherwise.

mod camera_path;
pub mod camera_paths;
mod connection;
pub mod contribution;
pub mod light_pass;
pub mod merge_photons;
mod merging;
#[cfg(feature = "reference")]
pub mod reference;
pub mod vertex;

pub use crate::transport::walk::sums::Counts;
