//! Layers and attributes of OpenEXR files: surfaces, errors and samples of the pixels, Cryptomatte, and the
//! facts of a render.
//!
//! ```no_run
//! use halflight::layers::{LayerSource, add_layers};
//! use halflight::render::{Layer, LayerSettings, Settings};
//! use halflight::save::{self, ExrFile, Patience};
//! use std::sync::Arc;
//!
//! let renderer = halflight::Renderer::open("scenes/cornell/cornell.obj")?;
//! let wanted = LayerSettings::new(&[Layer::Depth, Layer::Object], &renderer.scene().triangle_objects);
//! let settings = Settings { layers: Some(Arc::new(wanted.clone())), ..Settings::default() };
//! let result = renderer.render(&settings)?;
//! let mut file = ExrFile::of(&result.image);
//! add_layers(&mut file, &wanted.layers, &LayerSource::new(&result, renderer.scene()));
//! save::write_exr("cornell.exr".as_ref(), file, Patience::least())?;
//! # Ok::<(), halflight::Error>(())
//! ```

mod channels;
mod cryptomatte;
mod facts;

pub use channels::{LayerSource, add_layers};
pub use cryptomatte::{hash, id};
pub use facts::Facts;
