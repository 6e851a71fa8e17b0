//! PNG, BMP, TGA and WebP, decoded by the `image` crate.

use super::{FileError, Info, Kind, Picture, Samples, fail, filled, plausible};
use image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// Pixels that one byte can encode: at most 1032 bytes of deflate, with 8 pixels of a PNG in each.
const PIXELS_PER_BYTE: usize = 8 * 1032;

/// Bytes of the tables of a decoder.
pub(super) const TABLES: usize = 1 << 19;

pub(super) fn info(bytes: &[u8], kind: Kind) -> Result<Info, FileError> {
    let decoder = open(bytes, kind)?;
    let (width, height) = decoder.dimensions();
    let most = match kind {
        // A code may stand for any number of equal pixels.
        Kind::WebP => usize::MAX,
        _ => PIXELS_PER_BYTE,
    };
    let pixels = plausible(width as usize, height as usize, bytes.len(), most)?;
    let colour = decoder.color_type();
    let raw = pixels.saturating_mul(usize::from(colour.bytes_per_pixel()));
    let scratch = match kind {
        // Planes of luminance and chroma in whole blocks; or all four channels, and tables.
        Kind::WebP => 6 * pixels + 64 * (width + height) as usize + 2 * bytes.len() + (4 << 20),
        // Indices, or pixels of 15 bits, before expansion.
        Kind::Tga => raw,
        Kind::Png => png_scratch(bytes),
        // Two rows.
        _ => 16 * width as usize,
    };
    let kept = kept(colour, pixels);
    let converted = if is_rgba(colour) { 0 } else { kept };
    Ok(Info { kind, width, height, kept, peak: raw.saturating_add(converted + scratch + TABLES) })
}

pub(super) fn decode(bytes: &[u8], info: &Info) -> Result<Picture, FileError> {
    let mut picture = read(open(bytes, info.kind)?)?;
    if info.kind == Kind::WebP && is_short_webp(bytes) {
        picture.notes.push("its end is missing; the rest is used".into());
    }
    Ok(picture)
}

/// The pixels of a decoder.
fn read(decoder: impl ImageDecoder) -> Result<Picture, FileError> {
    let (width, height) = decoder.dimensions();
    let colour = decoder.color_type();
    let raw = usize::try_from(decoder.total_bytes()).map_err(FileError::new)?;
    let mut buffer = filled(raw, 0u8)?;
    decoder.read_image(&mut buffer).map_err(FileError::new)?;
    let has_alpha = colour.has_alpha();
    Ok(Picture { width, height, samples: samples(buffer, colour)?, has_alpha, notes: Vec::new() })
}

/// The decoder of a file, which has read the header.
fn open(bytes: &[u8], kind: Kind) -> Result<impl ImageDecoder + '_, FileError> {
    let format = match kind {
        Kind::Png => ImageFormat::Png,
        Kind::Bmp => ImageFormat::Bmp,
        Kind::Tga => ImageFormat::Tga,
        _ => ImageFormat::WebP,
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    // The caller checks the memory of the pixels.
    let mut limits = Limits::no_limits();
    limits.max_alloc = (kind == Kind::Png).then(|| png_scratch(bytes) as u64);
    reader.limits(limits);
    reader.into_decoder().map_err(FileError::new)
}

/// Bytes that a PNG takes without its pixels: chunks, an unpacked profile, and rows.
fn png_scratch(bytes: &[u8]) -> usize {
    const PROFILE: usize = 2 << 20;
    const WIDEST: usize = 1 << 20;
    let width =
        bytes.get(16..20).map_or(0, |width| u32::from_be_bytes([width[0], width[1], width[2], width[3]]));
    2 * bytes.len() + PROFILE + 16 * (width as usize).min(WIDEST)
}

/// Bytes of `pixels` as [`Samples`].
fn kept(colour: ColorType, pixels: usize) -> usize {
    let of_pixel = match colour {
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => 8,
        _ => 4,
    };
    pixels.saturating_mul(of_pixel)
}

/// True if the decoded bytes are used directly.
fn is_rgba(colour: ColorType) -> bool {
    colour == ColorType::Rgba8
}

/// The pixels with four channels.
fn samples(buffer: Vec<u8>, colour: ColorType) -> Result<Samples, FileError> {
    if is_rgba(colour) {
        return Ok(Samples::Bytes(buffer));
    }
    let channels = usize::from(colour.channel_count());
    let pixels = buffer.len() / usize::from(colour.bytes_per_pixel());
    let words = |bytes: &[u8]| u16::from_ne_bytes([bytes[0], bytes[1]]);
    Ok(match usize::from(colour.bytes_per_pixel()) / channels {
        1 => Samples::Bytes(expanded(&buffer, channels, 1, pixels, |bytes| bytes[0], u8::MAX)?),
        2 => Samples::Words(expanded(&buffer, channels, 2, pixels, words, u16::MAX)?),
        _ => fail!("{colour:?} is not supported"),
    })
}

/// RGBA of grey, grey with alpha, or RGB.
fn expanded<T: Copy>(
    buffer: &[u8],
    channels: usize,
    size: usize,
    pixels: usize,
    value: impl Fn(&[u8]) -> T,
    opaque: T,
) -> Result<Vec<T>, FileError> {
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

/// True if a WebP is shorter than its header states.
fn is_short_webp(bytes: &[u8]) -> bool {
    let stated = bytes.get(4..8).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    bytes.len() < stated as usize + 8
}
