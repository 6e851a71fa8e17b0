//! Light that is computed at few places and reused at many.

pub mod irradiance;
