//! Audit of a picture: the unbiased path tracer renders some of its pixels as well, in step with the picture.
//! Their difference beyond noise is bias (docs/decisions/error-estimate.md). Noise, blur and bias make the
//! error of a picture.

mod choice;
mod hidden;
mod method;
mod pixels;
mod region;
mod report;
mod risks;
mod run;
mod tiles;
mod verdict;

pub use hidden::MethodAtWork;
pub use method::{AuditedMethod, Borrower};
pub use pixels::{AuditState, AuditedPixels};
pub use region::{Region, Regions};
pub use report::{ErrorReport, NoiseAndBlur};
pub use risks::Risks;
pub use run::{Audit, AuditSettings, ExtraTime, Spent, audit_fraction};
pub use verdict::{AuditWork, Audited};
