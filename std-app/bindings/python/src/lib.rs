//! Extension module of the Python package `halflight_render`, whose Python files are its interface.

mod arrays;
mod error;
mod irradiance;
mod lightmap;
mod parts;
mod picture;
mod scene;
mod tools;
mod watch;

use pyo3::prelude::*;
use std::ffi::OsString;
use std::process::ExitCode;

#[pymodule]
mod _halflight {
    #[pymodule_export]
    use crate::irradiance::irradiance;
    #[pymodule_export]
    use crate::lightmap::{Lightmap, lightmap};
    #[pymodule_export]
    use crate::picture::{Rendered, keywords, render};
    #[pymodule_export]
    use crate::scene::{Renderer, build, open, read_sensors};
    #[pymodule_export]
    use crate::tools::{Photons, compare, decompose2, decompose3, encode, flip, read_image, write_image};
    #[pymodule_export]
    use crate::watch::Progress;
    #[pymodule_export]
    use crate::{program, version};
}

/// Runs the command line with these words, the first of which is the name of the program, and returns its
/// exit code.
#[pyfunction]
fn program(py: Python<'_>, words: Vec<OsString>) -> u8 {
    let code = py.detach(|| halflight::cli::main(words));
    (0..=u8::MAX).find(|number| ExitCode::from(*number) == code).unwrap_or(2)
}

/// Version of the package.
#[pyfunction]
fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}
