//! The halflight app: loads scenes, renders them with all processors, saves pictures and reports.
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
#![forbid(unsafe_code)]

// The command line names the library as other programs do.
extern crate self as halflight;

pub mod bake;
mod cgroup;
pub mod cli;
pub mod compare;
mod error;
mod file_error;
pub mod load;
pub mod memory;
pub mod pages;
pub mod picture;
pub mod pool;
pub mod quantity;
pub mod render;
mod renderer;
pub mod report;
pub mod save;
pub mod values;

pub use error::Error;
pub use renderer::{Camera, Renderer};
