//! Batch kernels.
