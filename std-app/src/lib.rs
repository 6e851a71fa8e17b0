//! The halflight app: loads scenes, renders them with all processors, saves pictures and reports.
//!
//! A picture takes four steps: [`load`] a scene, choose a camera, [`render`] the picture, [`save`] the image.
//! [`compare`] computes the difference between two images, [`report`] describes a render.
//!
//! ```no_run
//! use core::sync::atomic::AtomicBool;
//! use halflight::render::{Settings, render};
//! use halflight::{load, save};
//!
//! let loaded = load::load("scenes/cornell/cornell.obj".as_ref(), &load::LoadOptions::default())?;
//! let views = loaded.views();
//! let scene = views.scene(loaded.camera_or_default());
//! let interrupt = AtomicBool::new(false);
//! let result = render(&scene, &Settings::default(), &mut |_| {}, &interrupt)?;
//! save::write("cornell.png".as_ref(), &result.image)?;
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

pub mod bench;
mod cgroup;
pub mod compare;
mod file_error;
pub mod load;
pub mod memory;
mod pages;
pub mod picture;
pub mod pool;
pub mod render;
pub mod report;
pub mod save;
pub mod stability;
pub mod values;
