//! The error of reading or writing a picture, for the user who named the file.

use core::fmt;
use std::path::{Path, PathBuf};

/// A picture that cannot be read or written; displays as `FILE: reason`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureError {
    file: Option<PathBuf>,
    reason: String,
}

impl PictureError {
    /// An error without a file. Messages of several lines are joined.
    pub(crate) fn new(reason: impl fmt::Display) -> Self {
        Self { file: None, reason: reason.to_string().trim().replace('\n', ", ") }
    }

    /// The error, for this file.
    pub(crate) fn at(self, path: &Path) -> Self {
        Self { file: Some(path.to_owned()), ..self }
    }

    /// The file, if it is known.
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

/// Returns a [`PictureError`] with a formatted reason.
macro_rules! fail {
    ($($reason:tt)*) => {
        return Err($crate::picture::PictureError::new(format!($($reason)*)))
    };
}
pub(crate) use fail;
