//! Light that is computed at a few points and reused at many.

pub mod irradiance;
mod octree;
