//! File formats of pictures, and their encoders.

use super::exr::ExrFile;
use super::{Image, display_byte};
use crate::picture::{FileError, MAX_PIXELS, fail};
use image::codecs::{hdr::HdrEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder, Rgb};
use std::path::Path;

/// A file format, chosen by the extension of the file name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8 bits a channel, clamped to [0, 1] and through the sRGB curve.
    Png,
    /// OpenEXR, linear f32, ZIP compressed, lossless.
    Exr,
    /// Radiance RGBE, linear, 8 bits of mantissa; negative values become 0.
    Hdr,
    /// Portable float map, linear f32, uncompressed, lossless.
    Pfm,
}

impl Format {
    /// All formats, in the order of help texts.
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

    /// The format for a file name, in any case.
    ///
    /// # Errors
    /// The name ends in none of the four extensions.
    pub fn of(path: &Path) -> Result<Format, FileError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        Format::ALL
            .into_iter()
            .find(|format| extension.as_deref() == Some(format.extension()))
            .ok_or_else(|| FileError::new("the name must end in .png, .exr, .hdr or .pfm").at(path))
    }

    /// True if the values are linear radiance and not display values.
    pub fn is_linear(self) -> bool {
        self != Format::Png
    }
}

/// The bytes of a file with `image`.
///
/// # Errors
/// A picture without pixels or with more than [`MAX_PIXELS`].
pub fn encode(image: &Image, format: Format) -> Result<Vec<u8>, FileError> {
    if image.pixels.is_empty() || image.pixels.len() > MAX_PIXELS {
        fail!("{}x{} pixels cannot be written", image.width, image.height);
    }
    match format {
        Format::Png => encode_png(image),
        Format::Exr => ExrFile::of(image).encode(),
        Format::Hdr => encode_hdr(image),
        Format::Pfm => Ok(encode_pfm(image)),
    }
}

fn encode_png(picture: &Image) -> Result<Vec<u8>, FileError> {
    let display = |&value: &f32| display_byte(value);
    let samples: Vec<u8> = picture.pixels.iter().flatten().map(display).collect();
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&samples, picture.width, picture.height, ExtendedColorType::Rgb8)
        .map_err(FileError::new)?;
    Ok(bytes)
}

/// Largest value of RGBE: 8 bits of mantissa and a common exponent.
const LARGEST_RGBE: f32 = 255.0 / 256.0 * 1.701_411_8e38;

fn encode_hdr(picture: &Image) -> Result<Vec<u8>, FileError> {
    let storable = |value: f32| value.clamp(0.0, LARGEST_RGBE).max(0.0);
    let pixels: Vec<Rgb<f32>> = picture.pixels.iter().map(|pixel| Rgb(pixel.map(storable))).collect();
    let (width, height) = (picture.width as usize, picture.height as usize);
    if width != LONG_SCANLINE {
        return encode_scanlines(&pixels, [width, height]);
    }
    // Scanlines of one pixel are flat, and so is the picture of another size.
    let bytes = encode_scanlines(&pixels, [1, pixels.len()])?;
    let narrow = format!("-Y {} +X 1\n", pixels.len());
    let Some(at) = bytes.windows(narrow.len()).position(|window| window == narrow.as_bytes()) else {
        fail!("the picture cannot be encoded");
    };
    let (header, rest) = (&bytes[..at], &bytes[at + narrow.len()..]);
    Ok([header, format!("-Y {height} +X {width}\n").as_bytes(), rest].concat())
}

/// Length of scanlines that `image` encodes in runs although only shorter ones may be.
const LONG_SCANLINE: usize = 1 << 15;

fn encode_scanlines(pixels: &[Rgb<f32>], [width, height]: [usize; 2]) -> Result<Vec<u8>, FileError> {
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes).encode(pixels, width, height).map_err(FileError::new)?;
    Ok(bytes)
}

/// A text header of three lines, then rows of little-endian RGB from the bottom up.
fn encode_pfm(picture: &Image) -> Vec<u8> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", picture.width, picture.height).into_bytes();
    bytes.reserve(picture.pixels.len() * 12);
    for row in picture.pixels.chunks(picture.width as usize).rev() {
        bytes.extend(row.iter().flatten().flat_map(|value| value.to_le_bytes()));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hdr_scanlines_of_every_length_can_be_read() {
        for width in [1, 2, 7, 8, 9, 32_767, 32_768, 32_769, 65_536] {
            let pixel = |i: u32| [(1 + i % 97) as f32, 1.0, if i % 5 < 3 { 0.25 } else { 64.0 }];
            let picture = Image { width, height: 3, pixels: (0..3 * width).map(pixel).collect() };
            let bytes = encode(&picture, Format::Hdr).unwrap();
            let read = crate::picture::decode(&bytes, Path::new("a.hdr"), 1 << 30).map(Image::from).unwrap();
            assert_eq!((read.width, read.height), (width, 3));
            let pairs = picture.pixels.iter().flatten().zip(read.pixels.iter().flatten());
            // Eight bits of mantissa of the largest channel.
            assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() <= 0.5), "{width}");
        }
    }
}
