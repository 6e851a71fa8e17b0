//! Census: counts of what a scene contains, and the plan that chooses the code for it.

mod count;
mod plan;

pub use count::{Census, EnvironmentKind, SurfaceKinds};
pub use plan::{FeatureSet, Plan, WithFeatures};
