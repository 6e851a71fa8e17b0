//! Parts of tests that several crates share: random numbers, polygons with exact light, rooms made of them,
//! and gather rays into such rooms.

pub mod polygon;
mod random;
mod rays;
mod room;

pub use random::Random;
pub use rays::{GatherRays, Hit};
pub use room::{CeilingPatch, FloatingSquare, Room};
