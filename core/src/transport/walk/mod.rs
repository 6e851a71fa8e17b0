//! Subpaths from surface to surface: the scene as they see it, light subpaths, visibility along shadow rays,
//! classes of light, weights, random numbers and termination.

pub(in crate::transport) mod block;
mod block_lights;
pub(in crate::transport) mod block_scatter;
pub(in crate::transport) mod context;
pub(in crate::transport) mod dimension;
pub(in crate::transport) mod history;
pub(in crate::transport) mod light;
mod light_lanes;
pub(in crate::transport) mod mis;
pub(in crate::transport) mod path_classes;
pub(in crate::transport) mod photon_buffer;
pub(in crate::transport) mod points;
mod shading_normal;
pub(in crate::transport) mod sums;
pub(in crate::transport) mod termination;
pub(in crate::transport) mod visibility;
