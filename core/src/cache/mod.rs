//! Caches of light: computed at few points and reused at many.

pub mod irradiance;
mod octree;
pub mod radiance;
