//! Portable float map: a text header of four words, then rows of f32 from the bottom up.

use super::{FileError, Info, Kind, Picture, Samples, black, fail, pixels};

/// The header.
struct Header<'a> {
    width: usize,
    height: usize,
    /// Values of a pixel: 1 grey, 3 RGB, 4 RGBA.
    channels: usize,
    little_endian: bool,
    /// Factor on all colours.
    scale: f32,
    notes: Vec<String>,
    /// Bytes of the pixels.
    rest: &'a [u8],
}

pub(super) fn info(bytes: &[u8]) -> Result<Info, FileError> {
    let header = read_header(bytes)?;
    let of_pixel = if header.channels == 4 { 16 } else { 12 };
    let kept = header.width * header.height * of_pixel;
    Ok(Info { kind: Kind::Pfm, width: header.width as u32, height: header.height as u32, kept, peak: kept })
}

/// Colour (`PF`), grey (`Pf`) and colour with alpha (`PF4`), of either byte order.
pub(super) fn decode(bytes: &[u8]) -> Result<Picture, FileError> {
    let Header { width, height, channels, little_endian, scale, notes, rest } = read_header(bytes)?;
    let value = |bytes: &[u8]| {
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if little_endian { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) }
    };
    let has_alpha = channels == 4;
    let (mut rgb, mut alpha) = black(width * height, has_alpha)?;
    let rows = rest.chunks_exact(width * channels * 4);
    for (y, bytes) in (0..height).rev().zip(rows) {
        for (x, bytes) in bytes.chunks_exact(channels * 4).enumerate() {
            let at = |c: usize| value(&bytes[c * 4..]);
            let last = channels.min(3) - 1;
            rgb[y * width + x] = [0, 1, 2].map(|c: usize| scale * at(c.min(last)));
            if has_alpha {
                alpha[y * width + x] = at(3);
            }
        }
    }
    let samples = Samples::Floats { rgb, alpha };
    Ok(Picture { width: width as u32, height: height as u32, samples, has_alpha, notes })
}

fn read_header(bytes: &[u8]) -> Result<Header<'_>, FileError> {
    let mut rest = bytes;
    let channels = match word(&mut rest) {
        Some("PF") => 3,
        Some("Pf") => 1,
        Some("PF4") => 4,
        _ => fail!("not a PFM: it does not begin with PF or Pf"),
    };
    let mut number = |what| {
        let text = word(&mut rest).unwrap_or("");
        text.parse::<f64>().map_err(|_| FileError::new(format!("not a PFM: `{text}` is no {what}")))
    };
    let (width, height, scale) = (number("width")?, number("height")?, number("scale")?);
    let side = |value: f64| {
        (value >= 1.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0).then_some(value as usize)
    };
    let (Some(width), Some(height)) = (side(width), side(height)) else {
        fail!("a size of {width} by {height} is impossible");
    };
    let expected = pixels(width, height)? * channels * 4;
    if rest.len() < expected {
        fail!("truncated: {expected} bytes of pixels expected, {} found", rest.len());
    }
    let factor = scale.abs() as f32;
    let is_usable = factor > 0.0 && factor.is_finite();
    let notes = if is_usable { Vec::new() } else { vec![format!("its scale of {scale} is ignored")] };
    let factor = if is_usable { factor } else { 1.0 };
    Ok(Header { width, height, channels, little_endian: scale < 0.0, scale: factor, notes, rest })
}

/// The next word of the header; consumes the one blank after it, because pixels may follow.
fn word<'a>(rest: &mut &'a [u8]) -> Option<&'a str> {
    let bytes = rest.trim_ascii_start();
    let length = bytes.iter().take(32).position(u8::is_ascii_whitespace)?;
    let (word, after) = bytes.split_at(length);
    *rest = &after[1..];
    core::str::from_utf8(word).ok()
}
