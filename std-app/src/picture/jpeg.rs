//! JPEG. The decoder repairs damaged files and fills missing parts with grey; a strict pass comes first, so
//! that repairs are noted.

use super::{FileError, Info, Kind, Picture, Samples, fail, filled, pixels};
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

/// Bytes of the decoder for each pixel of the width: rows of blocks.
const ROWS: usize = 1 << 10;

pub(super) fn info(bytes: &[u8]) -> Result<Info, FileError> {
    let (_, width, height, channels) = open(bytes, false)?;
    let pixels = pixels(width, height)?;
    let kept = 4 * pixels;
    // Progressive pictures are coefficients of 16 bits, in whole blocks, until the last scan.
    let coefficients = if scan_markers(bytes).is_progressive { 8 * (width + 32) * (height + 32) } else { 0 };
    let peak = kept + channels * pixels + coefficients + ROWS * (width + 32) + 2 * bytes.len();
    Ok(Info { kind: Kind::Jpeg, width: width as u32, height: height as u32, kept, peak })
}

pub(super) fn decode(bytes: &[u8]) -> Result<Picture, FileError> {
    let mut notes = Vec::new();
    if !scan_markers(bytes).is_complete {
        notes.push("its end is missing, and grey or wrong in the picture".into());
    }
    let strictly = read(bytes, true);
    if let (Err(why), true) = (&strictly, notes.is_empty()) {
        notes.push(format!("it is damaged ({why}); the readable part is used"));
    }
    let (width, height, raw) = strictly.or_else(|_| read(bytes, false))?;
    let channels = raw.len() / (width * height);
    let mut rgba = filled(4 * width * height, u8::MAX)?;
    for (to, from) in rgba.chunks_exact_mut(4).zip(raw.chunks_exact(channels)) {
        to[..3].copy_from_slice(&[0, 1, 2].map(|c: usize| from[c.min(channels - 1)]));
    }
    let (width, height) = (width as u32, height as u32);
    Ok(Picture { width, height, samples: Samples::Bytes(rgba), has_alpha: false, notes })
}

/// Grey or RGB bytes.
fn read(bytes: &[u8], strictly: bool) -> Result<(usize, usize, Vec<u8>), FileError> {
    let (mut decoder, width, height, channels) = open(bytes, strictly)?;
    let mut raw = filled(channels * width * height, 0)?;
    decoder.decode_into(&mut raw).map_err(FileError::new)?;
    Ok((width, height, raw))
}

type Decoder<'a> = JpegDecoder<ZCursor<&'a [u8]>>;

/// A decoder that has read the headers, the width, the height, and the number of channels, 1 or 3.
fn open(bytes: &[u8], strictly: bool) -> Result<(Decoder<'_>, usize, usize, usize), FileError> {
    let options = DecoderOptions::default()
        .set_strict_mode(strictly)
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(FileError::new)?;
    let (Some((width, height)), Some(colours)) = (decoder.dimensions(), decoder.input_colorspace()) else {
        fail!("it has no size");
    };
    let (wanted, channels) = match colours {
        ColorSpace::Luma => (ColorSpace::Luma, 1),
        _ => (ColorSpace::RGB, 3),
    };
    decoder.set_options(options.jpeg_set_out_colorspace(wanted));
    Ok((decoder, width, height, channels))
}

/// Properties that the markers of a file reveal.
struct Markers {
    is_progressive: bool,
    /// The end marker exists.
    is_complete: bool,
}

/// Reads the markers of a file.
fn scan_markers(bytes: &[u8]) -> Markers {
    let mut markers = Markers { is_progressive: false, is_complete: false };
    let (mut at, mut scans) = (2, 0);
    while let Some(next) = bytes.get(at..).and_then(|rest| rest.iter().position(|&b| b == 0xff)) {
        at += next + 1;
        let length = |at: usize| Some(usize::from(*bytes.get(at)?) << 8 | usize::from(*bytes.get(at + 1)?));
        match bytes.get(at) {
            None => break,
            // Pixels, a restart, or a marker without content.
            Some(0 | 1 | 0xd0..=0xd8) => at += 1,
            Some(0xff) => {}
            Some(0xd9) => {
                markers.is_complete = true;
                break;
            }
            Some(&marker) => {
                scans += u32::from(marker == 0xda);
                markers.is_progressive |= marker == 0xc2 || scans > 1;
                at += 1 + length(at + 1).unwrap_or(0);
            }
        }
    }
    markers
}
