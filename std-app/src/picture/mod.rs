//! The one reader of pictures: textures, skies, references and the pictures of `compare` all come through
//! here.
//!
//! The bytes say the format, and the name where they do not. Reading believes nothing: the header says how
//! much memory the picture takes, and that is held against what is allowed before anything is decoded.

mod error;
mod exr;
mod hdr;
mod jpeg;
mod kind;
mod layers;
mod pfm;
mod raster;
mod rgbe;
mod tiff;

pub use error::PictureError;
pub use kind::Kind;

use crate::report::words::readable_bytes;
use std::path::Path;

/// Largest number of pixels of a picture, 16384².
pub const MAX_PIXELS: usize = 1 << 28;

/// Pixels of a decoded picture, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// RGBA of 8 bits. Colours are in the sRGB curve.
    Bytes(Vec<u8>),
    /// RGBA of 16 bits. Colours are in the sRGB curve.
    Words(Vec<u16>),
    /// RGB, linear, as the file has them: not always finite, not always positive.
    Floats {
        /// Colours.
        rgb: Vec<[f32; 3]>,
        /// Opacity, where the file has it; else empty.
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
    /// Whether the file has an alpha channel.
    pub has_alpha: bool,
    /// What had to be repaired, chosen or left out; each follows the name of the file and a colon.
    pub notes: Vec<String>,
}

impl Picture {
    /// Bytes of its pixels.
    pub fn bytes(&self) -> usize {
        match &self.samples {
            Samples::Bytes(samples) => samples.len(),
            Samples::Words(samples) => size_of_val(&samples[..]),
            Samples::Floats { rgb, alpha } => size_of_val(&rgb[..]) + size_of_val(&alpha[..]),
        }
    }
}

/// What a header says of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Survey {
    /// The format.
    pub kind: Kind,
    /// Pixels across, at least 1.
    pub width: u32,
    /// Pixels down, at least 1.
    pub height: u32,
    /// Bytes of the decoded pixels.
    pub kept: usize,
    /// The most bytes at any time of decoding: `kept` and what the decoder takes, without the file.
    pub peak: usize,
}

/// Reads the header of a picture. `name` gives the format where `bytes` do not (TGA).
///
/// # Errors
/// Bytes that are no picture, are of a kind that is not supported, or claim what cannot be.
pub fn survey(bytes: &[u8], name: &Path) -> Result<Survey, PictureError> {
    let kind = Kind::of(bytes, name)?;
    match kind {
        Kind::Exr => exr::survey(bytes),
        Kind::Hdr => hdr::survey(bytes),
        Kind::Pfm => pfm::survey(bytes),
        Kind::Jpeg => jpeg::survey(bytes),
        Kind::Tiff => tiff::survey(bytes),
        Kind::Png | Kind::Bmp | Kind::Tga | Kind::WebP => raster::survey(bytes, kind),
    }
}

/// Decodes a picture in no more than `most` bytes beside `bytes` themselves.
///
/// # Errors
/// As [`survey`]; pixels that cannot be read; a picture that needs more memory.
pub fn decode(bytes: &[u8], name: &Path, most: usize) -> Result<Picture, PictureError> {
    let survey = survey(bytes, name)?;
    if survey.peak > most {
        return Err(PictureError::new(format!(
            "its {}x{} pixels need {} to be read, and {} of memory are left",
            survey.width,
            survey.height,
            readable_bytes(survey.peak),
            readable_bytes(most)
        )));
    }
    match survey.kind {
        Kind::Exr => exr::decode(bytes),
        Kind::Hdr => hdr::decode(bytes),
        Kind::Pfm => pfm::decode(bytes),
        Kind::Jpeg => jpeg::decode(bytes),
        Kind::Tiff => tiff::decode(bytes, &survey),
        Kind::Png | Kind::Bmp | Kind::Tga | Kind::WebP => raster::decode(bytes, &survey),
    }
}

/// The number of pixels, where there is such a picture.
fn pixels(width: usize, height: usize) -> Result<usize, PictureError> {
    match width.checked_mul(height).filter(|&pixels| pixels <= MAX_PIXELS) {
        Some(0) => Err(PictureError::new("it has no pixels")),
        Some(pixels) => Ok(pixels),
        None => Err(PictureError::new(format!(
            "it claims {width}x{height} pixels; at most {MAX_PIXELS} are read"
        ))),
    }
}

/// As [`pixels`], of a file of `bytes` bytes, each of which stands for at most `most` pixels.
fn plausible(width: usize, height: usize, bytes: usize, most: usize) -> Result<usize, PictureError> {
    let pixels = pixels(width, height)?;
    if pixels > bytes.saturating_mul(most) {
        return Err(PictureError::new(format!(
            "it claims {width}x{height} pixels but is only {bytes} bytes long: truncated or malicious"
        )));
    }
    Ok(pixels)
}

/// `count` copies of `value`; an error where the system does not give the memory.
fn filled<T: Clone>(count: usize, value: T) -> Result<Vec<T>, PictureError> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).map_err(|_| PictureError::new("there is not enough memory for it"))?;
    values.resize(count, value);
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Enough for the pictures of tests.
    const MOST: usize = 1 << 24;

    #[test]
    fn bytes_that_are_no_picture_are_refused() {
        let files = [
            &b""[..],
            b"GIF89a",
            b"\x89PNG\r\n\x1a\n",
            b"BM\xff\xff\xff\xff",
            b"II*\0\xff\xff\xff\xff",
            b"RIFF\x10\0\0\0WEBPVP8L",
            b"\xff\xd8\xff\xe0\0",
            b"\x76\x2f\x31\x01\x02\0\0\0",
            b"#?RADIANCE\n\n-Y 99999 +X 99999\n",
            b"PF\n99999 99999\n-1\n",
        ];
        for bytes in files {
            let why = decode(bytes, Path::new("a.png"), MOST).unwrap_err().to_string();
            assert!(!why.is_empty() && !why.contains('\n'), "{why}");
        }
    }

    #[test]
    fn a_picture_that_needs_more_than_there_is_is_not_decoded() {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::GrayImage::new(1, 1).write_to(&mut bytes, image::ImageFormat::Bmp).unwrap();
        let mut bytes = bytes.into_inner();
        bytes[18..22].copy_from_slice(&2_500i32.to_le_bytes());
        bytes[22..26].copy_from_slice(&2_500i32.to_le_bytes());
        let why = decode(&bytes, Path::new("a.bmp"), MOST).unwrap_err().to_string();
        assert!(why.contains("2500x2500") && why.contains("16.0 MiB"), "{why}");
    }
}
