//! Errors of the library as exceptions of the package.

use halflight::Error;
use halflight::cli::Refused;
use halflight::render::RenderError;
use pyo3::prelude::*;
use std::path::Path;

/// The exception of an error.
pub(crate) fn raised(py: Python<'_>, error: impl Into<Error>) -> PyErr {
    let error = error.into();
    let class = match &error {
        Error::Load(load) if load.problem.starts_with("cannot be read") => "FileError",
        Error::Load(_) => "SceneError",
        Error::File(_) | Error::Render(RenderError::File(_)) => "FileError",
        Error::Render(RenderError::Memory { .. }) => "MemoryLimitError",
        Error::Render(_) => "SettingsError",
        _ => "Error",
    };
    exception(py, class, &error.to_string(), (error.file(), error.line(), error.help()))
}

/// The exception of settings that are refused.
pub(crate) fn refused(py: Python<'_>, error: &Refused) -> PyErr {
    exception(py, "SettingsError", &error.to_string(), (None, None, &error.help))
}

/// The exception of arguments that do not fit.
pub(crate) fn invalid(py: Python<'_>, problem: &str) -> PyErr {
    exception(py, "SettingsError", problem, (None, None, ""))
}

fn exception(
    py: Python<'_>,
    class: &str,
    text: &str,
    (file, line, help): (Option<&Path>, Option<u32>, &str),
) -> PyErr {
    let made = || {
        let class = py.import("halflight_render._errors")?.getattr(class)?;
        class.call1((text, file.map(|file| file.to_string_lossy()), line, help))
    };
    made().map_or_else(|error| error, PyErr::from_value)
}
