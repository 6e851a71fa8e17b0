//! Memory of the caller: arenas over borrowed bytes, and footprints known before they are filled.

mod arena;
mod footprint;
mod source;

pub use arena::{ALIGNMENT, Arena, Line, OutOfMemory};
pub use footprint::Footprint;
pub use source::{Buffer, MemorySource};
