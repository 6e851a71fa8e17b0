//! Reasons why a picture cannot be rendered.

use crate::memory::OutOfMemory;
use core::fmt;

/// Why a picture cannot be rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RenderError {
    /// The picture has no pixel, or more than 2^28.
    Size,
    /// There is no point, or more than 2^30.
    Points,
    /// The shard does not exist.
    Shard,
    /// The fraction of the audit is negative, 1 or more, or no number.
    Audit,
    /// This triangle has a vertex or a material that does not exist; 0 also where normals or texture
    /// coordinates are not as many as positions.
    Triangle(usize),
    /// There is not enough memory.
    Memory(OutOfMemory),
}

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RenderError::Size => write!(f, "a picture has 1 to 2^28 pixels"),
            RenderError::Points => write!(f, "there must be between 1 and 2^30 points"),
            RenderError::Shard => write!(f, "the shard does not exist"),
            RenderError::Audit => write!(f, "the fraction of an audit is from 0 to below 1"),
            RenderError::Triangle(index) => {
                write!(f, "triangle {index} refers to something that does not exist")
            }
            RenderError::Memory(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for RenderError {}

impl From<OutOfMemory> for RenderError {
    fn from(error: OutOfMemory) -> Self {
        RenderError::Memory(error)
    }
}
