//! Light transport: one file per method, each readable beside its paper.
//!
//! [`path`] is the path tracer that renders, a wavefront over a tile; [`mod@reference`] is the same estimator as a
//! textbook has it, one path at a time, kept to test the other against. For the irradiance cache [`overture`] finds the
//! places where it lacks a record, and [`gather`] makes one; [`shoot`] leaves the photons that [`PhotonLight`] gathers, and
//! [`maps`] makes of them what gather rays end in.

mod arrivals;
mod cached;
pub mod caustics;
mod context;
mod density;
mod estimator;
mod fences;
mod flight;
pub mod gather;
pub mod maps;
mod merge;
mod outline;
mod outlook;
mod overhang;
pub mod overture;
pub mod path;
mod pilot;
mod places;
mod probe;
mod radius;
pub mod reference;
mod reuse;
mod shadow;
pub mod shoot;
pub mod sight;
mod wave;

pub use context::SceneContext;
pub use density::PhotonLight;
pub use estimator::{Counters, PathSettings, UNLIMITED};
pub use merge::Merging;
pub use outlook::{Outlook, Vertex, WindowGain};
pub use path::PathTracer;
pub use pilot::Pilot;
pub use radius::RadiusSchedule;
