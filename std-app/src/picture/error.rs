//! What can go wrong with a picture file, in words for the person who named the file.

use core::fmt;
use std::path::{Path, PathBuf};

/// A picture that cannot be read or written, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureError {
    file: Option<PathBuf>,
    reason: String,
}

impl PictureError {
    /// An error of bytes that have no name yet. What a decoder says in several lines becomes one.
    pub(crate) fn new(reason: impl fmt::Display) -> Self {
        Self { file: None, reason: reason.to_string().trim().replace('\n', ", ") }
    }

    /// The same error, of this file.
    pub(crate) fn at(self, path: &Path) -> Self {
        Self { file: Some(path.to_owned()), ..self }
    }

    /// The file, where there is one.
    pub fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }
}

impl fmt::Display for PictureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.file {
            Some(file) => write!(f, "{}: {}", file.display(), self.reason),
            None => f.write_str(&self.reason),
        }
    }
}

impl core::error::Error for PictureError {}
