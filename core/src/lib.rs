//! halflight-core renders in the caller's memory, and gives the error of the picture.
//!
//! It allocates nothing, spawns no thread, reads no clock and forbids `unsafe`: it runs on a PC, as
//! WebAssembly and on a microcontroller, with the same bits. Most users need these:
//!
//! | type | purpose |
//! |---|---|
//! | [`Scene`] | borrowed views of the triangles, materials, textures, lights and the camera |
//! | [`Settings`] | size of the picture, [`Method`] with its options, seed, audit |
//! | [`Renderer`] | a picture in progress: [`Renderer::step`], [`Renderer::error`], [`Renderer::picture`] |
//! | [`Arena`] | the caller's bytes, of which [`Renderer::required_memory`] says the number |
//! | [`Executor`] | the caller's threads; [`Loop`] is one thread |
//!
//! # A picture until its error is small
//!
//! ```
//! use halflight_core::glam::Vec3;
//! use halflight_core::method::PathOptions;
//! use halflight_core::scene::{Camera, Material, Mesh, Triangle};
//! use halflight_core::{Arena, Line, Loop, Method, Renderer, Rgb, Scene, Settings, Until};
//!
//! // A lamp above a floor.
//! let positions = [
//!     [-2.0, 0.0, -2.0], [-2.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 0.0, -2.0],
//!     [-0.5, 2.0, -0.5], [0.5, 2.0, -0.5], [0.0, 2.0, 0.5],
//! ];
//! let triangle = |vertices, material| Triangle { vertices, material };
//! let triangles = [triangle([0, 1, 2], 0), triangle([0, 2, 3], 0), triangle([4, 5, 6], 1)];
//! let materials = [Material::diffuse(Rgb::splat(0.7)), Material::lamp(Rgb::splat(10.0))];
//! let scene = Scene {
//!     mesh: Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() },
//!     materials: &materials,
//!     textures: &[],
//!     lights: &[],
//!     environment: None,
//!     camera: Camera::look_at(Vec3::new(0.0, 2.0, 6.0), Vec3::ZERO, Vec3::Y, 40.0),
//! };
//!
//! let settings = Settings::new([32, 24]).with_method(Method::Path(PathOptions::default()));
//! let memory = Renderer::required_memory(&scene, &settings);
//! let mut lines = vec![Line::ZERO; memory.with_workers(1).div_ceil(64)];
//! let mut arena = Arena::over(&mut lines);
//! let mut executor = Loop::new(arena.slice(memory.scratch)?);
//! let mut renderer = Renderer::new(&scene, &settings, &mut arena, &mut executor)?;
//! renderer.step(&mut executor, Until::Error(0.02))?;
//!
//! let picture: Vec<Rgb> = renderer.picture().collect();
//! let error = renderer.error().expect("the picture is not black");
//! assert!(picture.len() == 32 * 24 && error.upper <= 0.02);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! [`Method::all`] lists the methods: path tracing, irradiance and radiance caching, photon mapping, stochastic
//! progressive photon mapping, light tracing, bidirectional path tracing, vertex connection and merging,
//! instant radiosity, Metropolis light transport, and [`Method::Auto`], which chooses by predicted error.
//! `examples/` has one picture by each method in one buffer (`tiny_render.rs`) and a picture on threads of the
//! caller (`own_threads.rs`).
//!
//! # Parts
//!
//! Parts can be used alone: rays against a mesh ([`bvh::Bvh`]), nearest photons ([`photon::PhotonMap`]),
//! scattering ([`bsdf::Bsdf`]), records and derivatives of irradiance ([`cache`]). Each has an example.
//!
//! # Layers
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
//! - [`audit`]: bias by path tracing of some pixels; noise, blur and bias together.
//! - [`renderer`]: the front of all methods, rounds and stop rules.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod audit;
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
pub mod renderer;
pub mod sampling;
pub mod scene;
pub mod transport;

pub use glam;
pub use halflight_simd::{Level, Tier};
pub use memory::{Arena, Line};
pub use method::{Executor, Loop, Method};
pub use renderer::{RenderError, Renderer, RequiredMemory, Settings, Until};
pub use scene::Scene;

/// Linear sRGB triple: radiance in W/(m² sr), reflectance, throughput; one meaning per use.
pub type Rgb = glam::Vec3;
