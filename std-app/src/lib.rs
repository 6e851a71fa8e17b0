//! halflight, the app: files in, pictures and reports out, with the core's passes run on all cores.
#![forbid(unsafe_code)]

pub mod compare;
pub mod drive;
pub mod load;
pub mod save;
