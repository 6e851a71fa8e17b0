//! Radiance caching (Křivánek et al. 2005): incident radiance of a point in coefficients of a basis.
//!
//! [`zernike`] is the basis, [`StrataTables`] its means over the strata of gather rays, [`Coefficients`] the
//! projection of a hemisphere, and [`derivatives`] its change with position. A [`CoefficientPool`] stores the
//! coefficients of many records, and [`RecordCoefficients`] those of a cache. [`lobes`] has the coefficients
//! of BSDFs, [`ServedLobes`] decides which lobes of a scene records serve, and [`mirrored_viewer`] serves
//! normals other than that of the hemisphere. [`sh`] are spherical harmonics, the basis of the paper, for
//! comparison.

mod coefficients;
pub mod derivatives;
pub mod lobes;
mod mirror;
mod pool;
mod record_coefficients;
#[cfg(test)]
mod rooms;
mod served;
pub mod sh;
mod strata;
pub mod zernike;

pub use coefficients::Coefficients;
pub use mirror::mirrored_viewer;
pub use pool::{CoefficientPool, PooledRecord, Weights};
pub(crate) use pool::{registers_of, write};
pub use record_coefficients::RecordCoefficients;
pub(crate) use served::ServedLobe;
pub use served::{LobeCensus, LobeSettings, ServedLobes};
pub use strata::StrataTables;

#[cfg(test)]
pub(in crate::cache) use rooms::{Sky, with_tables};
