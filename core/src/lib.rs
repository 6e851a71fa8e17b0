//! halflight-core: light transport in the caller's memory.
//!
//! The core allocates nothing, spawns no thread and holds no lock. Every structure states its
//! [`memory::Footprint`] before it is built and lives in an [`memory::Arena`] over the caller's bytes.
//!
//! Data meets the rooms in this order: [`scene`] borrowed views of what to render; [`census`] what the
//! scene holds and hence what can be left out; [`bvh`] and [`light`] structures built over it; [`cache`]
//! irradiance kept with its derivatives; [`photon`] light that was left on surfaces; [`transport`] the methods,
//! written against [`bsdf`], [`camera`] and [`sampling`]; [`film`] what they fill; [`estimate`] what is known of
//! the error.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod bsdf;
pub mod bvh;
pub mod cache;
pub mod camera;
pub mod census;
pub mod estimate;
pub mod film;
pub mod geometry;
pub mod light;
pub mod memory;
pub mod photon;
pub mod sampling;
pub mod scene;
pub mod transport;

pub use halflight_simd::{Level, Tier};

/// Linear sRGB triple: radiance in W/(m² sr), reflectance, throughput; one meaning per use.
pub type Rgb = glam::Vec3;
