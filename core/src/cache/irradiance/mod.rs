//! Irradiance caching. A [`Hemisphere`] holds the gather rays of one point; [`derivatives`] estimate the
//! change of its irradiance with position and normal; a [`Metric`] and [`validity`](mod@validity) give the
//! region of reuse. A [`Record`] stores all of these; the [`IrradianceCache`] stores the records.

pub mod derivatives;
mod evaluate;
mod lanes;
mod leaving;
pub mod metric;
mod neighbours;
mod packet;
mod record;
mod reflected;
mod store;
mod validity;

pub use super::hemisphere::{Hemisphere, SIDE_MAX};
pub use super::octree::POINTS;
pub use derivatives::{CellFlux, Derivatives, Hessian};
pub use lanes::QueryPoint;
pub(crate) use leaving::leaving_light;
pub use metric::Metric;
pub(in crate::cache) use neighbours::GRADIENT_VARIANCE;
pub use packet::Points;
pub use record::{OVERHANG_DISTANCE_FACTOR, OVERHANG_RADIUS_FACTOR, Record, SECTORS};
pub(crate) use reflected::Viewer;
pub use store::{CachedIrradiance, GREATEST_DEVIATION, IrradianceCache};
pub use validity::{Validity, validity, validity_with_lobe};

#[cfg(test)]
mod placement_tests;
