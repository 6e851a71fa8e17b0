//! BSDFs by their public functions: samples follow `evaluate` (chi-squared), energy is not gained, reflection
//! is reciprocal, values agree with published models, and stiff inputs give no NaN.

mod cases;
mod chi_squared;
mod energy;
mod known;
mod stiff;
