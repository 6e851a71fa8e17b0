//! Reconstruction of a picture from its two half-films, by the surfaces that its pixels see.

mod chains;
mod components;
mod first_surfaces;
mod surfaces;

pub use components::SurfaceComponents;
pub use first_surfaces::FirstSurfaces;
pub use surfaces::{NO_CLUSTER, PixelSurfaces};

#[cfg(test)]
mod tests;
