//! halflight-core: light transport in the caller's memory.
//!
//! The core allocates nothing, spawns no thread and holds no lock. Every structure states its
//! [`memory::Footprint`] before it is built and lives in an [`memory::Arena`] over the caller's bytes.
//!
//! The modules are layers: each imports only those above it in this list, which `cargo verify source`
//! enforces.
//!
//! - [`findings`]: decisions and numbers of a method, for reports.
//! - [`memory`], [`geometry`], [`sampling`]: arenas, vectors and rays, random numbers and their warps.
//! - [`scene`]: borrowed views of the meshes, materials, textures, lights and the camera to render.
//! - [`bsdf`]: scattering at a point. [`bvh`]: ray tracing. [`light`]: sampling of all lights together.
//! - [`film`]: pixels and tiles. [`photon`]: photon maps. [`cache`]: cached light with its derivatives.
//! - [`estimate`]: the error of a picture. [`census`]: the kinds of things in a scene, and the code they
//!   need.
//! - [`transport`]: subpaths, path tracing, photon tracing, gathering. [`method`]: the methods of rendering.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod bsdf;
pub mod bvh;
pub mod cache;
pub mod census;
pub mod estimate;
mod features;
pub mod film;
pub mod findings;
pub mod geometry;
pub mod light;
pub mod memory;
pub mod method;
pub mod photon;
pub mod sampling;
pub mod scene;
pub mod transport;

pub use halflight_simd::{Level, Tier};

/// Linear sRGB triple: radiance in W/(m² sr), reflectance, throughput; one meaning per use.
pub type Rgb = glam::Vec3;
