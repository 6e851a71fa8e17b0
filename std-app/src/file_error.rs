//! The error of reading or writing a file, for the user who named it.

use core::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// A file that cannot be read or written; displays as `FILE: reason`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    file: Option<PathBuf>,
    reason: String,
}

impl FileError {
    /// An error without a file. Messages of several lines are joined.
    pub(crate) fn new(reason: impl fmt::Display) -> Self {
        Self { file: None, reason: reason.to_string().trim().replace('\n', ", ") }
    }

    /// The error, for this file.
    pub fn at(self, path: &Path) -> Self {
        Self { file: Some(path.to_owned()), ..self }
    }

    /// An error of the system in opening, reading or writing a file, without its number.
    pub(crate) fn io(error: &io::Error) -> Self {
        Self::new(match error.kind() {
            io::ErrorKind::NotFound => "no such file".into(),
            io::ErrorKind::PermissionDenied => "permission denied".into(),
            io::ErrorKind::StorageFull => "the disk is full".into(),
            io::ErrorKind::QuotaExceeded => "the quota is used up".into(),
            io::ErrorKind::FileTooLarge => "it would be larger than files may be here".into(),
            io::ErrorKind::ReadOnlyFilesystem => "the disk is read-only".into(),
            io::ErrorKind::BrokenPipe => "its reader is gone".into(),
            io::ErrorKind::UnexpectedEof => "is damaged: it is too short".into(),
            _ => error.to_string(),
        })
    }

    /// The file, if it is known.
    pub fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.file {
            Some(file) => write!(f, "{}: {}", file.display(), self.reason),
            None => f.write_str(&self.reason),
        }
    }
}

impl core::error::Error for FileError {}

/// Returns a [`FileError`] with a formatted reason.
macro_rules! fail {
    ($($reason:tt)*) => {
        return Err($crate::file_error::FileError::new(format!($($reason)*)))
    };
}
pub(crate) use fail;
