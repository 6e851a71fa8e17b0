//! Irradiance caching: a [`Hemisphere`] is what one place sees, [`derivatives`] what its irradiance does when the
//! place moves or turns, and a [`Metric`] how far around it that may be relied upon. A [`Record`] keeps all this, and
//! the [`IrradianceCache`] all records.

pub mod derivatives;
mod evaluate;
mod hemisphere;
mod lanes;
pub mod metric;
mod neighbours;
mod packet;
mod record;
mod store;
mod validity;

pub use super::octree::POINTS;
pub use derivatives::{CellFlux, Derivatives, Hessian};
pub use hemisphere::{Hemisphere, SIDE_MAX};
pub use lanes::Asker;
pub use metric::Metric;
pub use packet::Points;
pub use record::{CLOSE, FINE, Record, SECTORS};
pub use store::{GREATEST_DEVIATION, Indirect, IrradianceCache};
pub use validity::{Validity, validity};

#[cfg(test)]
mod placement;
#[cfg(test)]
mod rooms;
