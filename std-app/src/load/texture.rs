//! Pictures that become textures: decoded once each, in parallel, and refused when they would not fit a sane
//! amount of memory.

use halflight_core::scene::{Texels, Texture, TextureTransform, Wrap};
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::path::Path;

/// Longest side in pixels.
const LONGEST_SIDE: u32 = 1 << 15;
/// Bytes that a decoded picture may take.
const MOST_BYTES: u64 = 1 << 30;

/// Decoded texels, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// RGBA, as the file has them.
    Bytes(Vec<u8>),
    /// RGB, linear; finite and not negative.
    Floats(Vec<f32>),
}

/// A decoded picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// The texels.
    pub pixels: Pixels,
    /// Whether the file has an alpha channel.
    pub has_alpha: bool,
    /// Texels that were not finite or negative and are 0 now.
    pub repaired: u64,
}

impl Picture {
    /// The picture as the core sees it: bytes are colours in the sRGB curve where `srgb`, else plain numbers.
    pub fn view(&self, srgb: bool, wrap: Wrap) -> Texture<'_> {
        let texels = match &self.pixels {
            Pixels::Floats(floats) => Texels::Float(bytemuck::cast_slice(floats)),
            Pixels::Bytes(bytes) if srgb => Texels::Srgb8(bytemuck::cast_slice(bytes)),
            Pixels::Bytes(bytes) => Texels::Linear8(bytemuck::cast_slice(bytes)),
        };
        Texture {
            width: self.width,
            height: self.height,
            texels,
            wrap,
            transform: TextureTransform::IDENTITY,
        }
    }
}

/// Decodes the bytes of a picture. `name` gives the format where the bytes do not (TGA).
pub fn decode(bytes: &[u8], name: &Path) -> Result<Picture, String> {
    let format = image::guess_format(bytes).or_else(|_| ImageFormat::from_path(name));
    let format =
        format.map_err(|_| "it is in no format that is known (png, jpg, bmp, tga, hdr, exr)".to_string())?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    limits.max_alloc = Some(MOST_BYTES);
    reader.limits(limits);
    let decoded = reader.decode().map_err(|error| error.to_string())?;
    let (width, height) = (decoded.width(), decoded.height());
    if width == 0 || height == 0 {
        return Err("it has no pixels".into());
    }
    let has_alpha = decoded.color().has_alpha();
    let mut repaired = 0;
    let pixels = match decoded {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            let mut floats = decoded.into_rgb32f().into_raw();
            for value in floats.iter_mut().filter(|value| !(value.is_finite() && **value >= 0.0)) {
                *value = 0.0;
                repaired += 1;
            }
            Pixels::Floats(floats)
        }
        _ => Pixels::Bytes(decoded.into_rgba8().into_raw()),
    };
    Ok(Picture { width, height, pixels, has_alpha, repaired })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_are_no_picture_are_refused() {
        for bytes in [
            &b""[..],
            b"GIF89a",
            b"\x89PNG\r\n\x1a\n",
            b"BM\xff\xff\xff\xff",
            b"#?RADIANCE\n\n-Y 99999 +X 99999\n",
        ] {
            assert!(decode(bytes, Path::new("a.png")).is_err());
        }
    }

    #[test]
    fn a_png_keeps_its_bytes() {
        let mut bytes = Cursor::new(Vec::new());
        let picture = image::RgbaImage::from_raw(2, 1, vec![1, 2, 3, 4, 250, 251, 252, 253]).unwrap();
        picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
        let decoded = decode(bytes.get_ref(), Path::new("a.png")).unwrap();
        assert_eq!((decoded.width, decoded.height, decoded.has_alpha), (2, 1, true));
        assert_eq!(decoded.pixels, Pixels::Bytes(vec![1, 2, 3, 4, 250, 251, 252, 253]));
    }

    #[test]
    fn a_bomb_is_refused_before_it_is_decoded() {
        let mut bytes = Cursor::new(Vec::new());
        image::GrayImage::new(1, 1).write_to(&mut bytes, ImageFormat::Bmp).unwrap();
        let mut bytes = bytes.into_inner();
        bytes[18..22].copy_from_slice(&30_000i32.to_le_bytes());
        bytes[22..26].copy_from_slice(&30_000i32.to_le_bytes());
        assert!(decode(&bytes, Path::new("a.bmp")).is_err());
    }
}
