//! Light transport, in folders by idea; each file is readable beside its paper.
//!
//! `walk` leads subpaths from surface to surface. [`path`] is the path tracer that renders, a wavefront over a tile;
//! [`path::reference`] is the same estimator as a textbook has it, one path at a time, kept to test the other against.
//! [`cached`] places, gathers and looks up records of the irradiance cache; [`photon_mapping`] traces photons and
//! estimates their density; [`caustics`] merges them with paths; `prepass` learns what the first sample needs.

pub mod cached;
pub mod caustics;
mod estimator;
pub mod path;
pub mod photon_mapping;
mod prepass;
mod walk;

pub use caustics::merge::CausticMerging;
pub use estimator::{Counters, PathSettings, UNLIMITED};
pub use path::PathIntegrator;
pub use path::reuse_pilot::Pilot;
pub use photon_mapping::density::PhotonLight;
pub use photon_mapping::radius::RadiusSchedule;
pub use prepass::environment_visibility::{Outlook, Vertex, WindowGain};
pub use walk::context::SceneContext;
