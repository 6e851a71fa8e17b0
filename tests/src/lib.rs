//! Shared helpers of the cross-crate tests.
pub mod agreement;
pub mod memory;
pub mod references;
pub mod render;
pub mod rooms;
pub mod scenes;
pub mod snapshot;
pub mod statistics;
