//! Files of films and caches: one container, one identity of their scene and settings
//! (docs/file-container.md).

mod bake;
mod cache;
mod cache_header;
mod container;
mod film;
mod film_header;
mod hash;
mod identity;
mod rewritten;

pub use bake::is_bake;
pub(super) use bake::{BakeHeader, Beside, Reader as BakeReader, Tables, write as write_bake};
pub use cache::inspect as inspect_cache;
pub(super) use cache::{Loaded, open as open_cache, write as write_cache};
pub(super) use cache_header::{CacheHeader, Half, View};
pub(super) use film::{Reader as FilmReader, write as write_film};
pub(super) use film_header::FilmHeader;
pub(super) use identity::Identity;
pub(super) use rewritten::RewrittenFile;
