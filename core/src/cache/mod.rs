//! Caches of light: computed at few points and reused at many.

mod hemisphere;
mod hessian;
pub mod irradiance;
mod octree;
pub mod radiance;
#[cfg(test)]
mod skies;
pub mod view;
