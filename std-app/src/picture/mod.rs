//! Reading of pictures: textures, environment maps, references and the pictures of `compare`.
//!
//! The content determines the format (the name only for TGA). The header gives the memory that decoding
//! takes, which is compared with the limit before anything is decoded.

#[cfg(feature = "formats")]
mod exr;
mod hdr;
mod jpeg;
mod kind;
#[cfg(feature = "formats")]
mod layers;
#[cfg(not(feature = "formats"))]
mod no_formats;
mod pfm;
mod primaries;
mod raster;
mod rgbe;
#[cfg(feature = "formats")]
mod tiff;

pub use crate::file_error::FileError;
pub(crate) use crate::file_error::fail;
pub use kind::Kind;

use crate::quantity::readable_bytes;
#[cfg(not(feature = "formats"))]
use no_formats::{exr, tiff};
use std::path::Path;

/// Most pixels of a picture, 16384².
pub const MAX_PIXELS: usize = 1 << 28;

/// Pixels of a decoded picture, in rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// RGBA of 8 bits. Colours are in the sRGB curve.
    Bytes(Vec<u8>),
    /// RGBA of 16 bits. Colours are in the sRGB curve.
    Words(Vec<u16>),
    /// Linear RGB of the file; values may be negative, infinite or NaN.
    Floats {
        /// Colours.
        rgb: Vec<[f32; 3]>,
        /// Opacity; empty if the file has none.
        alpha: Vec<f32>,
    },
}

/// A decoded picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels across, at least 1.
    pub width: u32,
    /// Pixels down, at least 1.
    pub height: u32,
    /// `width * height` pixels.
    pub samples: Samples,
    /// True if the file has an alpha channel.
    pub has_alpha: bool,
    /// Repairs and choices, each to follow the name of the file and a colon.
    pub notes: Vec<String>,
}

impl Picture {
    /// True if there are as many samples as the size says.
    pub(crate) fn is_complete(&self) -> bool {
        let pixels = self.width as usize * self.height as usize;
        match &self.samples {
            Samples::Bytes(samples) => samples.len() == 4 * pixels,
            Samples::Words(samples) => samples.len() == 4 * pixels,
            Samples::Floats { rgb, alpha } => {
                rgb.len() == pixels && (alpha.is_empty() || alpha.len() == pixels)
            }
        }
    }

    /// Bytes of the pixels.
    pub fn bytes(&self) -> usize {
        match &self.samples {
            Samples::Bytes(samples) => samples.len(),
            Samples::Words(samples) => size_of_val(&samples[..]),
            Samples::Floats { rgb, alpha } => size_of_val(&rgb[..]) + size_of_val(&alpha[..]),
        }
    }
}

/// Format, size and memory of a picture, from its header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Info {
    /// The format.
    pub kind: Kind,
    /// Pixels across, at least 1.
    pub width: u32,
    /// Pixels down, at least 1.
    pub height: u32,
    /// Bytes of the decoded pixels.
    pub kept: usize,
    /// Most bytes at any time of decoding, without the file.
    pub peak: usize,
}

/// Reads the header of a picture. `name` identifies TGA files.
///
/// # Errors
/// Bytes that are no picture, of an unsupported kind, or of an impossible size.
pub fn read_info(bytes: &[u8], name: &Path) -> Result<Info, FileError> {
    let kind = Kind::of(bytes, name)?;
    match kind {
        Kind::Exr => exr::info(bytes),
        Kind::Hdr => hdr::info(bytes),
        Kind::Pfm => pfm::info(bytes),
        Kind::Jpeg => jpeg::info(bytes),
        Kind::Tiff => tiff::info(bytes),
        Kind::Png | Kind::Bmp | Kind::Tga | Kind::WebP => raster::info(bytes, kind),
    }
}

/// Decodes a picture in at most `most` bytes, without `bytes` themselves.
///
/// # Errors
/// Those of [`read_info`]; unreadable pixels; a picture that needs more memory.
pub fn decode(bytes: &[u8], name: &Path, most: usize) -> Result<Picture, FileError> {
    let info = read_info(bytes, name)?;
    if info.peak > most {
        let [needed, left] = [info.peak, most].map(readable_bytes);
        let Info { width, height, .. } = info;
        fail!("its {width}x{height} pixels need {needed} to be read, and {left} of memory are left");
    }
    match info.kind {
        Kind::Exr => exr::decode(bytes),
        Kind::Hdr => hdr::decode(bytes),
        Kind::Pfm => pfm::decode(bytes),
        Kind::Jpeg => jpeg::decode(bytes),
        Kind::Tiff => tiff::decode(bytes, &info),
        Kind::Png | Kind::Bmp | Kind::Tga | Kind::WebP => raster::decode(bytes, &info),
    }
}

/// The number of pixels, if it is possible.
fn pixels(width: usize, height: usize) -> Result<usize, FileError> {
    match width.checked_mul(height).filter(|&pixels| pixels <= MAX_PIXELS) {
        Some(0) => Err(FileError::new("it has no pixels")),
        Some(pixels) => Ok(pixels),
        None => fail!("it claims {width}x{height} pixels; at most {MAX_PIXELS} are read"),
    }
}

/// As [`pixels`], for a file of `bytes` bytes that each encode at most `most` pixels.
fn plausible(width: usize, height: usize, bytes: usize, most: usize) -> Result<usize, FileError> {
    let pixels = pixels(width, height)?;
    if pixels > bytes.saturating_mul(most) {
        fail!("it claims {width}x{height} pixels but is only {bytes} bytes long: truncated or malicious");
    }
    Ok(pixels)
}

/// `count` copies of `value`; an error if the system has no memory.
fn filled<T: Clone>(count: usize, value: T) -> Result<Vec<T>, FileError> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).map_err(|_| FileError::new("there is not enough memory for it"))?;
    values.resize(count, value);
    Ok(values)
}

/// Black linear pixels, and their opacity (zero) if there is one.
fn black(pixels: usize, has_alpha: bool) -> Result<(Vec<[f32; 3]>, Vec<f32>), FileError> {
    Ok((filled(pixels, [0.0; 3])?, filled(if has_alpha { pixels } else { 0 }, 0.0)?))
}
