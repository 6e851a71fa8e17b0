//! Rays, boxes, cones and frames.

mod bounds;
mod cone;
mod frame;
mod ray;

pub use bounds::Bounds;
pub(crate) use cone::Cone;
pub use frame::Frame;
pub use ray::{Hit, MISS, Ray};
