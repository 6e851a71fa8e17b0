//! View-bound records (Zhao, Belcour and Nowrouzezahrai 2019): the radiance that a narrow lobe reflects
//! towards the camera is a scalar field on the surface, as irradiance is.
//!
//! [`ViewedLobe`] has the strata of one lobe and the derivatives of the radiance that it reflects.
//! [`ViewRecords`] keeps records of many points in the octree of irradiance, with the same weights,
//! boundaries, comparison of neighbours and clamping.

mod lobe;
mod records;
#[cfg(test)]
mod tests;

pub use lobe::{LobeSamples, SIDE_MAX, ViewedLobe};
pub use records::{LobeKind, ViewRecords};
