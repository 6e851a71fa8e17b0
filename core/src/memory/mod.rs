//! The caller's memory: an arena over borrowed bytes, and footprints that say beforehand how many.

mod arena;
mod footprint;

pub use arena::{ALIGNMENT, Arena, Line, OutOfMemory};
pub use footprint::Footprint;
