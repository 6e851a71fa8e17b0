//! The error of the library: whatever ends a load, a render or the writing of a picture.

use crate::file_error::FileError;
use crate::load::LoadError;
use crate::render::RenderError;
use core::fmt;
use std::path::Path;

/// Why a scene or a picture could not be made. Displays the file and its line, if there are, the problem, and
/// what to do. It is `Send`, `Sync` and `'static`, so `?` turns it into other errors.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// A scene cannot be loaded.
    Load(LoadError),
    /// A picture cannot be rendered.
    Render(RenderError),
    /// A file cannot be read or written.
    File(FileError),
}

impl Error {
    /// The file of the problem, if there is one.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Load(error) => Some(&error.file),
            Self::Render(RenderError::File(error)) | Self::File(error) => error.file(),
            Self::Render(_) => None,
        }
    }

    /// The line of the problem in its file, from 1, if it is known.
    pub fn line(&self) -> Option<u32> {
        match self {
            Self::Load(error) if error.line > 0 => Some(error.line),
            _ => None,
        }
    }

    /// Advice; empty if the problem says it.
    pub fn help(&self) -> &str {
        match self {
            Self::Load(error) => &error.help,
            Self::Render(error) => error.help(),
            Self::File(_) => "",
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Its text ends with the help.
            Self::Load(error) => error.fmt(f),
            Self::Render(error) if error.help().is_empty() => error.fmt(f),
            Self::Render(error) => write!(f, "{error}\n  help: {}", error.help()),
            Self::File(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for Error {}

impl From<LoadError> for Error {
    fn from(error: LoadError) -> Self {
        Self::Load(error)
    }
}

impl From<RenderError> for Error {
    fn from(error: RenderError) -> Self {
        Self::Render(error)
    }
}

impl From<FileError> for Error {
    fn from(error: FileError) -> Self {
        Self::File(error)
    }
}
