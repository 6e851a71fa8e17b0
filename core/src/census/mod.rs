//! What a scene holds, counted once, and the plan that follows from it: which code, which structures.

mod count;
mod plan;

pub use count::{Census, EnvironmentKind, Kinds};
pub use plan::{FeatureSet, Plan, WithFeatures};
