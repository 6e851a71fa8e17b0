//! Subpaths from surface to surface: the scene as they see it, light subpaths, visibility along shadow rays.

pub(in crate::transport) mod context;
pub(in crate::transport) mod light;
pub(in crate::transport) mod visibility;
