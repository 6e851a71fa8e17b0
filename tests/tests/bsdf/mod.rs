//! BSDFs judged from outside: what `sample` draws is what `evaluate` says (chi-squared), no energy is gained,
//! light can be followed both ways, pictures agree with the models they claim, and nothing stiff makes a NaN.

mod cases;
mod chi_squared;
mod energy;
mod known;
mod stiff;
