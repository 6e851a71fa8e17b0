//! Radiance caching (Křivánek et al. 2005): incident radiance of a point in coefficients of a basis.
//!
//! [`zernike`] is the default basis, [`sh`] that of the paper, and [`Basis`] is either. [`GatherTables`]
//! project the light of gather rays: for [`zernike`] by [`StrataTables`] to [`Coefficients`], with
//! [`derivatives`] as their change with position. A [`CoefficientPool`] stores the coefficients of many
//! records, and [`RecordCoefficients`] those of a cache. [`lobes`] has the coefficients of BSDFs, and
//! [`ServedLobes`] decides which lobes of a scene records serve. For normals other than that of the
//! hemisphere [`mirrored_viewer`] moves the viewer, and spherical harmonics are rotated.

mod basis;
mod coefficients;
pub mod derivatives;
pub mod lobes;
mod mirror;
mod pool;
mod record_coefficients;
mod served;
pub mod sh;
mod strata;
mod tables;
pub mod zernike;

pub use basis::{Basis, Representation};
pub use coefficients::Coefficients;
pub use mirror::mirrored_viewer;
pub use pool::{CoefficientPool, Expansion, PooledRecord, Weights};
pub use record_coefficients::RecordCoefficients;
pub(crate) use served::ServedLobe;
pub use served::{LobeCensus, LobeSettings, ServedLobes};
pub use strata::StrataTables;
pub use tables::GatherTables;
pub(crate) use tables::Projection;
