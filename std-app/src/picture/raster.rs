//! What the `image` crate decodes: PNG, BMP, TGA, WebP.

use super::{Kind, Picture, PictureError, Samples, Survey, filled, plausible};
use image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// Pixels that one byte of a file can stand for: deflate yields at most 1032 bytes from one, and a PNG packs
/// 8 pixels in each.
const PIXELS_PER_BYTE: usize = 8 * 1032;

/// Bytes for a decoder's tables.
pub(super) const TABLES: usize = 1 << 19;

pub(super) fn survey(bytes: &[u8], kind: Kind) -> Result<Survey, PictureError> {
    let decoder = open(bytes, kind)?;
    let (width, height) = decoder.dimensions();
    let most = match kind {
        // Codes of four bytes may stand for any number of equal pixels, but not in vain.
        Kind::WebP => usize::MAX,
        _ => PIXELS_PER_BYTE,
    };
    let pixels = plausible(width as usize, height as usize, bytes.len(), most)?;
    let colour = decoder.color_type();
    let raw = pixels.saturating_mul(usize::from(colour.bytes_per_pixel()));
    let scratch = match kind {
        // Planes of luminance and chroma in whole blocks; or all four channels, and tables for parts of the
        // picture.
        Kind::WebP => 6 * pixels + 64 * (width + height) as usize + 2 * bytes.len() + (4 << 20),
        // Indices, or pixels of 15 bits, before they are expanded.
        Kind::Tga => raw,
        Kind::Png => beside_pixels(bytes),
        // Two rows.
        _ => 16 * width as usize,
    };
    let kept = kept(colour, pixels);
    let converted = if is_rgba(colour) { 0 } else { kept };
    Ok(Survey { kind, width, height, kept, peak: raw.saturating_add(converted + scratch + TABLES) })
}

pub(super) fn decode(bytes: &[u8], survey: &Survey) -> Result<Picture, PictureError> {
    let mut picture = read(open(bytes, survey.kind)?)?;
    if survey.kind == Kind::WebP && is_short_webp(bytes) {
        picture.notes.push("its end is missing; what is there is used".into());
    }
    Ok(picture)
}

/// The pixels that `decoder` has.
pub(super) fn read(decoder: impl ImageDecoder) -> Result<Picture, PictureError> {
    let (width, height) = decoder.dimensions();
    let colour = decoder.color_type();
    let raw = usize::try_from(decoder.total_bytes()).map_err(PictureError::new)?;
    let mut buffer = filled(raw, 0u8)?;
    decoder.read_image(&mut buffer).map_err(PictureError::new)?;
    let has_alpha = colour.has_alpha();
    Ok(Picture { width, height, samples: samples(buffer, colour)?, has_alpha, notes: Vec::new() })
}

/// What the decoder of a file of `kind` says, before any pixel is decoded.
pub(super) fn open(bytes: &[u8], kind: Kind) -> Result<impl ImageDecoder + '_, PictureError> {
    let format = match kind {
        Kind::Png => ImageFormat::Png,
        Kind::Bmp => ImageFormat::Bmp,
        Kind::Tga => ImageFormat::Tga,
        Kind::WebP => ImageFormat::WebP,
        _ => ImageFormat::Tiff,
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    // Pixels are the caller's matter, who knows what is left.
    let mut limits = Limits::no_limits();
    limits.max_alloc = (kind == Kind::Png).then(|| beside_pixels(bytes) as u64);
    reader.limits(limits);
    reader.into_decoder().map_err(PictureError::new)
}

/// Bytes that a PNG may take beside its pixels: chunks, a profile that is unpacked, and rows.
fn beside_pixels(bytes: &[u8]) -> usize {
    const PROFILE: usize = 2 << 20;
    const WIDEST: usize = 1 << 20;
    let width =
        bytes.get(16..20).map_or(0, |width| u32::from_be_bytes([width[0], width[1], width[2], width[3]]));
    2 * bytes.len() + PROFILE + 16 * (width as usize).min(WIDEST)
}

/// Bytes of `pixels` as [`Samples`].
pub(super) fn kept(colour: ColorType, pixels: usize) -> usize {
    let of_pixel = match colour {
        ColorType::Rgb32F => 12,
        ColorType::Rgba32F => 16,
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => 8,
        _ => 4,
    };
    pixels.saturating_mul(of_pixel)
}

/// Whether bytes of that colour are used as they are.
fn is_rgba(colour: ColorType) -> bool {
    colour == ColorType::Rgba8
}

/// All channels of all pixels as four.
fn samples(buffer: Vec<u8>, colour: ColorType) -> Result<Samples, PictureError> {
    if is_rgba(colour) {
        return Ok(Samples::Bytes(buffer));
    }
    let channels = usize::from(colour.channel_count());
    let pixels = buffer.len() / usize::from(colour.bytes_per_pixel());
    let words = |bytes: &[u8]| u16::from_ne_bytes([bytes[0], bytes[1]]);
    let floats = |bytes: &[u8]| f32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    Ok(match usize::from(colour.bytes_per_pixel()) / channels {
        1 => Samples::Bytes(expanded(&buffer, channels, 1, pixels, |bytes| bytes[0], u8::MAX)?),
        2 => Samples::Words(expanded(&buffer, channels, 2, pixels, words, u16::MAX)?),
        _ => {
            let mut rgb = filled(pixels, [0.0; 3])?;
            let mut alpha = filled(if colour.has_alpha() { pixels } else { 0 }, 0.0)?;
            for (i, pixel) in buffer.chunks_exact(4 * channels).enumerate() {
                rgb[i] = [0, 4, 8].map(|at| floats(&pixel[at..]));
                if let Some(alpha) = alpha.get_mut(i) {
                    *alpha = floats(&pixel[12..]);
                }
            }
            Samples::Floats { rgb, alpha }
        }
    })
}

/// Grey, grey with alpha, or RGB as RGBA.
fn expanded<T: Copy>(
    buffer: &[u8],
    channels: usize,
    size: usize,
    pixels: usize,
    value: impl Fn(&[u8]) -> T,
    opaque: T,
) -> Result<Vec<T>, PictureError> {
    let mut rgba = filled(4 * pixels, opaque)?;
    for (to, from) in rgba.chunks_exact_mut(4).zip(buffer.chunks_exact(channels * size)) {
        let at = |c: usize| value(&from[c * size..]);
        let colour = if channels < 3 { [0; 3] } else { [0, 1, 2] };
        to[..3].copy_from_slice(&colour.map(at));
        if channels.is_multiple_of(2) {
            to[3] = at(channels - 1);
        }
    }
    Ok(rgba)
}

/// A WebP says how long it is.
fn is_short_webp(bytes: &[u8]) -> bool {
    let says = bytes.get(4..8).map_or(0, |says| u32::from_le_bytes([says[0], says[1], says[2], says[3]]));
    bytes.len() < says as usize + 8
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{DynamicImage, ImageBuffer};
    use std::path::Path;

    fn there_and_back(picture: DynamicImage, format: ImageFormat, name: &str) -> Picture {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        super::super::decode(bytes.get_ref(), Path::new(name), 1 << 24).unwrap()
    }

    #[test]
    fn alpha_of_every_format_is_kept() {
        let pixels = vec![1, 2, 3, 4, 250, 251, 252, 253];
        for (format, name) in [
            (ImageFormat::Png, "a"),
            (ImageFormat::WebP, "a"),
            (ImageFormat::Tiff, "a"),
            (ImageFormat::Tga, "a.tga"),
        ] {
            let picture = ImageBuffer::from_raw(2, 1, pixels.clone()).unwrap();
            let picture = there_and_back(DynamicImage::ImageRgba8(picture), format, name);
            assert_eq!((picture.width, picture.height, picture.has_alpha), (2, 1, true), "{format:?}");
            assert_eq!(picture.samples, Samples::Bytes(pixels.clone()), "{format:?}");
            assert_eq!(picture.notes, [""; 0]);
        }
    }

    #[test]
    fn fewer_channels_become_four() {
        let grey = DynamicImage::ImageLuma8(ImageBuffer::from_raw(2, 1, vec![7, 9]).unwrap());
        let expected = Samples::Bytes(vec![7, 7, 7, 255, 9, 9, 9, 255]);
        assert_eq!(there_and_back(grey, ImageFormat::Png, "a").samples, expected);
        let rgb = DynamicImage::ImageRgb8(ImageBuffer::from_raw(1, 1, vec![7, 8, 9]).unwrap());
        assert_eq!(there_and_back(rgb, ImageFormat::Bmp, "a").samples, Samples::Bytes(vec![7, 8, 9, 255]));
        let words = DynamicImage::ImageLumaA16(ImageBuffer::from_raw(1, 1, vec![700, 900]).unwrap());
        let picture = there_and_back(words, ImageFormat::Png, "a");
        assert_eq!((picture.samples, picture.has_alpha), (Samples::Words(vec![700, 700, 700, 900]), true));
    }

    #[test]
    fn what_is_cut_short_is_refused_or_noted() {
        let noise = |i: u32| (i.wrapping_mul(2_654_435_761) >> 24) as u8;
        let pixels: Vec<u8> = (0..40 * 30 * 3).map(noise).collect();
        let picture = DynamicImage::ImageRgb8(ImageBuffer::from_raw(40, 30, pixels).unwrap());
        for format in
            [ImageFormat::Png, ImageFormat::Bmp, ImageFormat::Tga, ImageFormat::WebP, ImageFormat::Tiff]
        {
            let mut bytes = Cursor::new(Vec::new());
            picture.write_to(&mut bytes, format).unwrap();
            let bytes = bytes.into_inner();
            for length in [bytes.len() / 4, bytes.len() / 2, bytes.len() * 9 / 10] {
                let read = super::super::decode(&bytes[..length], Path::new("a.tga"), 1 << 24);
                assert!(read.is_err() || !read.unwrap().notes.is_empty(), "{format:?} {length}");
            }
        }
    }
}
