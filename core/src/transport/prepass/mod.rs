//! Prepasses: structures learned before the first sample.

pub(in crate::transport) mod environment_visibility;
