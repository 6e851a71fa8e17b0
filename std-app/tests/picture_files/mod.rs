//! Formats of picture files, one file each, by the reader of the library.

mod damaged;
mod exr;
mod hdr;
mod jpeg;
mod kind;
mod pfm;
mod raster;
mod tiff;

use halflight::picture::{self, FileError, Kind, Picture, Samples};
use std::io::Cursor;
use std::path::Path;

/// Memory that is enough for these pictures.
const MOST: usize = 1 << 24;

/// The picture of `bytes`, whose name says nothing.
fn read_bytes(bytes: &[u8]) -> Result<Picture, FileError> {
    picture::decode(bytes, Path::new("a"), MOST)
}
