//! The caller's memory: an arena over borrowed bytes, and footprints that say beforehand how many.

mod arena;
mod footprint;
mod source;

pub use arena::{ALIGNMENT, Arena, Line, OutOfMemory};
pub use footprint::Footprint;
pub use source::{Buffer, MemorySource};
