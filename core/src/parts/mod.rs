//! Parts of the renderer that can be used alone, each with its example. Nothing else of the crate is needed.

pub mod eigen;
pub mod irradiance;
pub mod photons;
pub mod rays;
pub mod scattering;
