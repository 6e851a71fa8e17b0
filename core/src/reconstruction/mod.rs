//! Reconstruction of a picture from its two half-films, by the surfaces that its pixels see.

mod surfaces;

pub use surfaces::{NO_CLUSTER, PixelSurfaces};
