//! Shared helpers of the cross-crate tests.
pub mod scenes;
pub mod statistics;
