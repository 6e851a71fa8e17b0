//! Irradiance caching in transport: placement of records, their gather rays and boundaries, and lookup by
//! paths (Ward et al. 1988; Krivanek et al. 2006).

pub(in crate::transport) mod boundary;
pub mod gather;
mod gather_point;
pub mod lobe;
pub(in crate::transport) mod lookup;
pub(in crate::transport) mod overhang;
pub mod placement;
pub mod point_places;
pub mod view;
