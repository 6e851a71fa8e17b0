//! Light transport, in folders by idea; each file is readable beside its paper.
//!
//! `walk` leads subpaths from surface to surface. `wavefront` advances many camera paths together. [`path`]
//! is the path tracer that renders; [`path::reference`] is the same estimator as a textbook has it, one path
//! at a time, kept to test the other against. The other folders hold methods that know some of the light from
//! a structure, each an [`Estimator`] of the path tracer: [`photon_mapping`] traces photons and estimates
//! their density; [`caustics`] merges them with paths; [`cached`] places, gathers and looks up records of the
//! irradiance cache. [`metropolis`] runs Markov chains over the random numbers of paths. `prepass` learns
//! what the first sample needs.

pub mod bidirectional;
pub mod cached;
pub mod caustics;
pub mod instant_radiosity;
pub mod metropolis;
pub mod path;
pub mod photon_mapping;
mod prepass;
mod settings;
mod walk;
mod wavefront;

pub use cached::lookup::CacheView;
pub use caustics::merge::CausticMerging;
pub use path::reuse_pilot::Pilot;
pub use path::{Estimator, PathIntegrator, PathReuse, Sharing};
pub use photon_mapping::density::PhotonLight;
pub use photon_mapping::radius::RadiusSchedule;
pub use prepass::environment_visibility::{Outlook, Vertex, WindowGain};
pub use settings::{Counters, PathSettings, UNLIMITED};
pub use walk::context::SceneContext;
