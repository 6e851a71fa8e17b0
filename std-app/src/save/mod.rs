//! Pictures in files: PNG for the eye, EXR, HDR and PFM for numbers. All formats are read by
//! [`crate::picture`].

mod exr;
mod file;
mod hdr;
mod image;
mod part;
mod pfm;
mod place;
mod png;
mod stream;

pub use crate::picture::{MAX_PIXELS, PictureError};
pub(crate) use file::{check_place, not_written, replace, replace_with, words};
pub use file::{check_writable, read, read_within, write, write_with};
pub use image::Image;
pub use part::abandon;
pub use place::{Identity, Place};
pub use png::{from_srgb, to_srgb};
pub use stream::Patience;

use std::path::Path;

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
