//! Errors of a render.

use halflight_core::memory::OutOfMemory;
use std::io;
use std::path::{Path, PathBuf};

/// Reasons why there is no picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RenderError {
    /// The picture has no pixels, or more than 2^28.
    Size,
    /// The reference differs in size.
    Reference,
    /// The memory limit does not suffice.
    Memory {
        /// Bytes needed up to the failing structure.
        needed: usize,
        /// Bytes allowed by the limit or given by the system.
        available: usize,
    },
    /// The threads could not be started.
    Threads(String),
    /// No such shard, or more shards than tiles.
    Shard,
    /// A cache is to be loaded or saved, but the method has none.
    NoCache,
    /// A film or cache file cannot be used.
    File(FileError),
}

impl core::fmt::Display for RenderError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Size => write!(f, "the picture must have between 1 and 2^28 pixels"),
            Self::Reference => write!(f, "reference and picture differ in size"),
            Self::Memory { needed, available } => {
                write!(f, "not enough memory: at least {needed} bytes needed, {available} available")
            }
            Self::Threads(why) => write!(f, "the threads could not be started: {why}"),
            Self::Shard => write!(f, "shard I/N is invalid: N must not exceed the number of tiles"),
            Self::NoCache => write!(f, "only the method irradiance-cache has a cache to load or save"),
            Self::File(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for RenderError {}

impl From<OutOfMemory> for RenderError {
    fn from(error: OutOfMemory) -> Self {
        Self::Memory { needed: error.needed, available: error.available }
    }
}

impl From<FileError> for RenderError {
    fn from(error: FileError) -> Self {
        Self::File(error)
    }
}

/// A film or cache file that cannot be read, written, continued or merged, with the reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    file: PathBuf,
    reason: String,
}

impl FileError {
    pub(super) fn new(file: &Path, reason: impl Into<String>) -> Self {
        Self { file: file.to_owned(), reason: reason.into() }
    }

    /// An error of reading a file.
    pub(super) fn io(file: &Path, error: &io::Error) -> Self {
        let reason = match error.kind() {
            io::ErrorKind::NotFound => "no such file".into(),
            io::ErrorKind::PermissionDenied => "permission denied".into(),
            io::ErrorKind::UnexpectedEof => "is damaged: it is too short".into(),
            _ => error.to_string(),
        };
        Self::new(file, reason)
    }
}

impl core::fmt::Display for FileError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}: {}", self.file.display(), self.reason)
    }
}

impl core::error::Error for FileError {}
