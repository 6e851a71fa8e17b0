//! Points, rays and frames: the small change of every room.

mod bounds;
mod frame;
mod ray;

pub use bounds::Bounds;
pub use frame::Frame;
pub use ray::{Hit, MISS, Ray};
