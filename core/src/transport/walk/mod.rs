//! Subpaths from surface to surface: the scene as they see it, light subpaths, visibility along shadow rays,
//! classes of light, weights, random numbers and termination.

pub(crate) mod block;
mod block_lights;
pub(crate) mod block_scatter;
pub(crate) mod block_stages;
pub(crate) mod context;
pub(crate) mod dimension;
pub(crate) mod history;
pub(crate) mod light;
mod light_lanes;
pub(crate) mod mis;
pub(crate) mod path_classes;
pub(crate) mod photon_buffer;
pub(crate) mod points;
pub(crate) mod shading;
mod shading_normal;
pub(crate) mod shadow_tag;
pub(crate) mod splats;
pub(crate) mod subpath;
pub(crate) mod sums;
pub(crate) mod techniques;
pub(crate) mod termination;
pub(crate) mod vertex;
pub(crate) mod visibility;
