//! Pictures in files: PNG for the eye, EXR, HDR and PFM for numbers; written and read back.
//!
//! Reading believes nothing: sizes are checked against the limits and against the length of the file
//! before memory is asked for.

mod error;
mod exr;
mod file;
mod hdr;
mod image;
mod part;
mod pfm;
mod place;
mod png;
mod stream;

pub use error::PictureError;
pub(crate) use file::{check_place, not_written, replace, replace_with, words};
pub use file::{check_writable, read, write, write_with};
pub use image::Image;
pub use part::abandon;
pub use place::{Identity, Place};
pub use png::{from_srgb, to_srgb};
pub use stream::Patience;

use std::path::Path;

/// Largest number of pixels of a picture, 16384².
pub const MAX_PIXELS: usize = 1 << 28;

/// A file format, chosen by the extension of the file name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8 bits a channel, clamped to [0, 1] and through the sRGB curve.
    Png,
    /// OpenEXR, linear f32, ZIP compressed, lossless.
    Exr,
    /// Radiance RGBE, linear, 8 bits of mantissa: values below 0 become 0.
    Hdr,
    /// Portable float map, linear f32, uncompressed, lossless.
    Pfm,
}

impl Format {
    /// All of them, in the order in which help texts name them.
    pub const ALL: [Format; 4] = [Format::Png, Format::Exr, Format::Hdr, Format::Pfm];

    /// The extension, without its dot.
    pub fn extension(self) -> &'static str {
        match self {
            Format::Png => "png",
            Format::Exr => "exr",
            Format::Hdr => "hdr",
            Format::Pfm => "pfm",
        }
    }

    /// The format that the name of a file asks for; upper case is as good.
    ///
    /// # Errors
    /// Names that end in none of the four extensions.
    pub fn of(path: &Path) -> Result<Format, PictureError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        Format::ALL
            .into_iter()
            .find(|format| extension.as_deref() == Some(format.extension()))
            .ok_or_else(|| PictureError::new("the name must end in .png, .exr, .hdr or .pfm").at(path))
    }

    /// Whether the values are linear radiance and not display values.
    pub fn is_linear(self) -> bool {
        self != Format::Png
    }
}

/// The picture in the bytes of a file, in linear light. PNG goes back through the sRGB curve.
///
/// Alpha is ignored. Of an EXR: the first layer that has R, G and B, else one with Y, else any with a
/// single channel; what lies outside its data window is black.
///
/// # Errors
/// Whatever is malformed, too large or not supported; the message says what.
pub fn decode(bytes: &[u8], format: Format) -> Result<Image, PictureError> {
    match format {
        Format::Png => png::decode(bytes),
        Format::Exr => exr::decode(bytes),
        Format::Hdr => hdr::decode(bytes),
        Format::Pfm => pfm::decode(bytes),
    }
}

/// The bytes of a file that holds `image`.
///
/// # Errors
/// A picture without pixels or above [`MAX_PIXELS`].
pub fn encode(image: &Image, format: Format) -> Result<Vec<u8>, PictureError> {
    if image.pixels.is_empty() || image.pixels.len() > MAX_PIXELS {
        let (width, height) = (image.width, image.height);
        return Err(PictureError::new(format!("{width}x{height} pixels cannot be written")));
    }
    match format {
        Format::Png => png::encode(image),
        Format::Exr => exr::encode(image),
        Format::Hdr => hdr::encode(image),
        Format::Pfm => Ok(pfm::encode(image)),
    }
}

/// Pixels that one byte of a file can stand for: deflate yields at most 1032 bytes from one, and a PNG
/// packs 8 pixels in each. A file that claims more is refused before memory is asked for.
const PIXELS_PER_BYTE: usize = 8 * 1032;

/// `width * height`, where a file of `bytes` bytes may claim that.
fn plausible(width: usize, height: usize, bytes: usize) -> Result<usize, PictureError> {
    let pixels = width.checked_mul(height).filter(|&pixels| pixels <= MAX_PIXELS);
    match pixels {
        Some(0) => Err(PictureError::new("it has no pixels")),
        Some(pixels) if pixels <= bytes.saturating_mul(PIXELS_PER_BYTE) => Ok(pixels),
        Some(_) => Err(PictureError::new(format!(
            "it claims {width}x{height} pixels but is only {bytes} bytes long: truncated or malicious"
        ))),
        None => Err(PictureError::new(format!(
            "it claims {width}x{height} pixels; at most {MAX_PIXELS} are read"
        ))),
    }
}
