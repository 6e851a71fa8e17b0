//! Light transport: one folder per algorithm, each file readable beside its paper.
//!
//! `walk` traces subpaths from surface to surface. `wavefront` advances many camera paths together. [`path`]
//! is the path tracer that renders; [`path::single`] is the textbook form of the same estimator, one path at
//! a time, against which the path tracer is tested. The other folders hold methods that supply part of the
//! light from a data structure, most of them as a [`LightEstimator`] of the path tracer: [`photon_mapping`]
//! traces photons and estimates their density; [`caustics`] merges photons with paths; [`cached`] places,
//! gathers and looks up records of irradiance and radiance; [`instant_radiosity`] connects paths with virtual
//! lights. [`bidirectional`] connects and merges camera paths with light vertices, [`metropolis`] runs Markov
//! chains over the random numbers of such paths. `prepass` learns structures before the first sample.
//!
//! The feature `reference` compiles pixels of the textbook forms of path tracing and of bidirectional path
//! tracing, for tests and fuzzing.

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

pub use cached::lookup::{CacheView, SuppliedLobes};
pub use caustics::merge::CausticMerging;
pub use path::reuse_pilot::Pilot;
pub use path::{IrradiancePoint, LightEstimator, LightPart, PathIntegrator, PathReuse, Sharing};
pub use photon_mapping::density::PhotonLight;
pub use photon_mapping::radius::RadiusSchedule;
pub use prepass::environment_visibility::{VisibilityGain, VisibilityPrepass, VisibilityVertex};
pub use settings::{Counters, PathSettings, UNLIMITED};
pub use walk::context::SceneContext;
