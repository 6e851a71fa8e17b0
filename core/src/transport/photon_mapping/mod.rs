//! Photon mapping (Jensen 1996; Hachisuka and Jensen 2009): photon tracing, visible points, density
//! estimation and final gathering.

pub(in crate::transport) mod density;
pub mod deposit;
pub mod final_gather;
pub mod focus;
pub mod hidden;
pub mod irradiance;
pub(in crate::transport) mod radius;
pub mod visible_points;
