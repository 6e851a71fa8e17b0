//! Errors of a render.

pub use crate::file_error::FileError;
use halflight_core::memory::OutOfMemory;

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
    /// The core refuses the mesh, the points or the shard.
    Core(halflight_core::RenderError),
    /// A film or cache file cannot be used.
    File(FileError),
}

impl RenderError {
    /// Advice; empty if the problem says it.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Memory { .. } => "raise the memory limit, or render fewer pixels",
            Self::NoCache => "choose one of these methods, or no cache file",
            _ => "",
        }
    }
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
            Self::Shard => write!(
                f,
                "shard I/N is invalid: N must not exceed the number of tiles; a window must lie in the \
                 picture, and has no film file"
            ),
            Self::NoCache => {
                write!(f, "only the methods irradiance-cache and radiance-cache have a cache to load or save")
            }
            Self::Core(error) => error.fmt(f),
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

impl From<halflight_core::RenderError> for RenderError {
    fn from(error: halflight_core::RenderError) -> Self {
        match error {
            halflight_core::RenderError::Memory(error) => error.into(),
            error => Self::Core(error),
        }
    }
}

impl From<FileError> for RenderError {
    fn from(error: FileError) -> Self {
        Self::File(error)
    }
}
