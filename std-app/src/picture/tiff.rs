//! TIFF: by the `image` crate, except grey floats, which it does not support.

use super::raster::{self, TABLES};
use super::{FileError, Info, Kind, Picture, Samples, black, fail, plausible};
use image::ImageDecoder;
use std::io::Cursor;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};

/// Pixels that one byte can encode: 1032 bytes of deflate with 8 pixels each.
const PIXELS_PER_BYTE: usize = 8 * 1032;

pub(super) fn info(bytes: &[u8]) -> Result<Info, FileError> {
    let (width, height, raw, kept) = match grey_floats(bytes)? {
        Some((width, height, channels)) => {
            let area = width as usize * height as usize;
            (width, height, area * 4 * channels, area * if channels == 2 { 16 } else { 12 })
        }
        None => {
            let decoder = raster::open(bytes, Kind::Tiff)?;
            let (width, height) = decoder.dimensions();
            let pixels = plausible(width as usize, height as usize, bytes.len(), PIXELS_PER_BYTE)?;
            let raw = usize::try_from(decoder.total_bytes()).unwrap_or(usize::MAX);
            (width, height, raw, raster::kept(decoder.color_type(), pixels))
        }
    };
    // The pixels of the decoder, a copy, an unpacked strip or tile, and four channels of CMYK instead of
    // three.
    let peak = kept.saturating_add(raw.saturating_mul(4)).saturating_add(2 * bytes.len() + TABLES);
    Ok(Info { kind: Kind::Tiff, width, height, kept, peak })
}

pub(super) fn decode(bytes: &[u8], info: &Info) -> Result<Picture, FileError> {
    let Some((width, height, channels)) = grey_floats(bytes)? else {
        let mut decoder = raster::open(bytes, Kind::Tiff)?;
        let mut limits = image::Limits::no_limits();
        limits.max_alloc = Some(info.peak as u64);
        decoder.set_limits(limits).map_err(FileError::new)?;
        return raster::read(decoder);
    };
    let mut limits = Limits::default();
    (limits.decoding_buffer_size, limits.intermediate_buffer_size) = (info.peak, info.peak);
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(FileError::new)?.with_limits(limits);
    let DecodingResult::F32(values) = decoder.read_image().map_err(FileError::new)? else {
        fail!("its kind of numbers is not supported");
    };
    let pixels = width as usize * height as usize;
    if values.len() < pixels * channels {
        fail!("truncated: pixels are missing");
    }
    let has_alpha = channels == 2;
    let (mut rgb, mut alpha) = black(pixels, has_alpha)?;
    for (i, pixel) in values.chunks_exact(channels).take(pixels).enumerate() {
        rgb[i] = [pixel[0]; 3];
        if let Some(alpha) = alpha.get_mut(i) {
            *alpha = pixel[1];
        }
    }
    Ok(Picture { width, height, samples: Samples::Floats { rgb, alpha }, has_alpha, notes: Vec::new() })
}

/// Width, height and channels of a picture of grey floats; `None` for others.
fn grey_floats(bytes: &[u8]) -> Result<Option<(u32, u32, usize)>, FileError> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(FileError::new)?;
    let channels = match decoder.colortype().map_err(FileError::new)? {
        ColorType::Gray(32) => 1,
        ColorType::GrayA(32) => 2,
        _ => return Ok(None),
    };
    let (width, height) = decoder.dimensions().map_err(FileError::new)?;
    plausible(width as usize, height as usize, bytes.len(), PIXELS_PER_BYTE)?;
    Ok(Some((width, height, channels)))
}
