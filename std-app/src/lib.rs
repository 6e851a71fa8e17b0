//! Loading of scenes, renders with all processors, pictures and reports in files: the library of the program.
//!
//! [`Renderer`] owns a loaded scene, its hierarchy, lights and threads, and renders many views of it.
//! [`load`] reads scenes from files, [`load::SceneParts`] makes them from arrays, [`render`] has the settings
//! and results, [`save`] writes pictures. [`compare`] computes the difference between two pictures,
//! [`report`] describes a render.
//!
//! ```no_run
//! use halflight::render::{Settings, Stop};
//! use halflight::{Renderer, save};
//!
//! let renderer = Renderer::open("scenes/cornell/cornell.obj")?;
//! let stop = Stop { error: Some(1e-3), ..Stop::default() };
//! let picture = renderer.render(&Settings { stop, ..Settings::default() })?;
//! save::write("cornell.png".as_ref(), &picture.image)?;
//! if let Some(error) = picture.error {
//!     println!("relMSE {:.1e}, 95 %: {:.1e} to {:.1e}", error.relmse, error.lower, error.upper);
//! }
//! # Ok::<(), halflight::Error>(())
//! ```
//!
//! # Many views, and irradiance at sensors
//!
//! Views and sensors have the coordinates of the scene's files. All share one build.
//!
//! ```no_run
//! use halflight::Renderer;
//! use halflight::bake::{BakeSettings, Sensor};
//! use halflight::load::View;
//! use halflight::render::{Settings, Stop};
//!
//! let renderer = Renderer::open("scenes/cornell/cornell.obj")?;
//! let settings = Settings { stop: Stop { spp: Some(64), ..Stop::default() }, ..Settings::default() };
//! for x in [-0.2, 0.0, 0.2] {
//!     let view = View { eye: [x, 1.0, 3.5], look_at: [0.0, 1.0, 0.0], up: [0.0, 1.0, 0.0] };
//!     let camera = renderer.camera(view, 40.0).expect("eye and target differ");
//!     let picture = renderer.render_view(camera, &settings)?;
//!     println!("mean radiance {:?}", picture.image.mean());
//! }
//!
//! let sensors = [Sensor { position: [0.0, 0.0, 0.0], normal: [0.0, 1.0, 0.0] }];
//! let stop = Stop { error: Some(0.02), ..Stop::default() };
//! let baked = renderer.irradiance_at(&sensors, &BakeSettings { stop, ..BakeSettings::default() })?;
//! for point in baked.values {
//!     println!("{} W/m², 95 %: {} to {}", point.value(), point.lower, point.upper);
//! }
//! # Ok::<(), halflight::Error>(())
//! ```
//! # Features
//!
//! All are on by default: `cli`, the command line; `report`, pages and objects; `gltf`; `formats`, pictures
//! in OpenEXR, TIFF and WebP; `sky`; `tev`, the viewer. A file is refused that needs a feature left out.
#![forbid(unsafe_code)]

// The command line names the library as other programs do.
extern crate self as halflight;

pub mod bake;
mod cgroup;
#[cfg(feature = "cli")]
pub mod cli;
pub mod compare;
mod error;
mod file_error;
pub mod layers;
pub mod load;
pub mod memory;
pub mod pages;
pub mod picture;
pub mod pool;
mod provenance;
pub mod quantity;
pub mod render;
mod renderer;
#[cfg(feature = "report")]
pub mod report;
pub mod save;
#[cfg(feature = "sky")]
pub mod sky;
#[cfg(feature = "tev")]
pub mod tev;
pub mod values;

pub use error::Error;
// One line of a manifest is enough.
pub use halflight_core::{self, Rgb};
pub use provenance::Provenance;
pub use renderer::{Camera, Renderer};
