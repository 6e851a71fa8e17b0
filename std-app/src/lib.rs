//! halflight, the app: files in, pictures and reports out, with the core's passes run on all cores.
//!
//! A picture takes four steps: [`load`] a scene, choose a camera, [`drive`] the render, [`save`] the image;
//! [`compare`] says how far two images are apart, [`report`] tells a person how it went.
//!
//! ```no_run
//! use core::sync::atomic::AtomicBool;
//! use halflight::drive::{Settings, render};
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
pub mod compare;
pub mod drive;
pub mod load;
pub mod memory;
mod pages;
pub mod picture;
pub mod report;
pub mod save;
pub mod stability;
