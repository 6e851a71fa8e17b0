//! Lights: what a scene file can name, and how transport samples all of them together.

mod source;

pub use source::{Environment, PointLight};
