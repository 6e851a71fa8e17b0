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
//! | [`IrradianceRenderer`] | irradiance at many points, each with a 95 % interval |
//! | [`LightProbe`] | spherical harmonics of the light around a point, from irradiances |
//! | [`Arena`] | the caller's bytes, of which [`Renderer::required_memory`] says the number |
//! | [`Line`] | 64 aligned bytes, of which a `Vec` or a static array makes the arena |
//! | [`Executor`] | the caller's threads, with an example; [`Loop`] is one thread |
//!
//! On a PC the feature `std` is needed for speed: with it [`Level::detect`] finds AVX2 and AVX-512 while the
//! program runs. Without it the kernels use the instructions of the build target alone, on x86-64 those of
//! SSE2. The bits of a picture are the same.
//!
//! # A picture until its error is small
//!
//! ```
//! use halflight_core::glam::Vec3;
//! use halflight_core::scene::{Camera, Material, Mesh, Triangle};
//! use halflight_core::{Arena, Line, Loop, Method, PathOptions, Renderer, Rgb, Scene, Settings, Until};
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
//!     camera: Camera::look_at(Vec3::new(0.0, 2.0, 6.0), Vec3::ZERO, Vec3::Y, 40.0),
//!     ..Scene::default()
//! };
//!
//! let settings = Settings::new([32, 24]).with_method(Method::Path(PathOptions::default()));
//! let memory = Renderer::required_memory(&scene, &settings);
//! let mut lines = vec![Line::ZERO; Line::count(memory.with_workers(1))];
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
//! [`Method::all`] lists the methods: path tracing, irradiance and radiance caching, photon mapping,
//! stochastic progressive photon mapping, light tracing, bidirectional path tracing, vertex connection and
//! merging, instant radiosity, Metropolis light transport, and [`Method::Auto`], which chooses by predicted
//! error. An arena for the largest of their [`Renderer::required_memory`] renders a picture by each in turn.
//! `examples/` has this in a static buffer (`tiny_render.rs`) and a picture on threads of the caller
//! (`own_threads.rs`).
//!
//! A picture ends by its samples or its error ([`Until`]). Time and interrupts end it through the executor:
//! [`Loop::until`], or [`Executor::is_over`].
//!
//! # Parts
//!
//! [`parts`] can be used alone: rays against a mesh, nearest photons, irradiance where a ray hits, eigen
//! decomposition, scattering. [`IrradianceRenderer`] is for many points, for intervals and for threads.
//!
//! # Promise
//!
//! Everything on these pages is kept within a version 0.x: `cargo verify doors` compares it with the list in
//! `core/doors.txt`. Modules that these pages do not show are layers for the program, the tests and fuzzing,
//! and may change at any time; docs/architecture.md describes them.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod findings;
pub mod memory;
pub mod parts;
pub mod renderer;
pub mod scene;

// Layers for the program, the tests and fuzzing. They may change with any version.
#[doc(hidden)]
pub mod audit;
#[doc(hidden)]
pub mod bsdf;
#[doc(hidden)]
pub mod bvh;
#[doc(hidden)]
pub mod cache;
#[doc(hidden)]
pub mod census;
#[doc(hidden)]
pub mod estimate;
mod features;
#[doc(hidden)]
pub mod film;
#[doc(hidden)]
pub mod geometry;
#[doc(hidden)]
pub mod light;
#[doc(hidden)]
pub mod method;
#[doc(hidden)]
pub mod photon;
#[doc(hidden)]
pub mod reconstruction;
#[doc(hidden)]
pub mod sampling;
#[doc(hidden)]
pub mod transport;

pub use estimate::ErrorEstimate;
pub use film::{Film, Pixel};
pub use glam;
pub use halflight_simd::{Level, Tier};
pub use memory::{Arena, Line};
pub use method::choice::Goal;
pub use method::{
    Basis, BidirectionalSettings, CacheOptions, Executor, LobeSettings, Loop, Method, MethodKind,
    MetropolisSettings, Passed, PathOptions, PhotonSettings, PointMethod, PrimarySpace, Shard,
    VirtualLightSettings, Worker,
};
pub use renderer::{
    IrradianceRenderer, LightProbe, PointIrradiance, PointSettings, RenderError, Renderer, RequiredMemory,
    Settings, Until,
};
pub use scene::Scene;
pub use transport::{Counters, IrradiancePoint, LightPart};

/// Linear sRGB triple: radiance in W/(m² sr), reflectance, throughput; one meaning per use.
pub type Rgb = glam::Vec3;
