//! Portable float map: a text header of three lines, then f32 rows from the bottom up.

use super::{Image, PictureError, plausible};

/// Little endian RGB.
pub(super) fn encode(image: &Image) -> Vec<u8> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", image.width, image.height).into_bytes();
    bytes.reserve(image.pixels.len() * 12);
    for row in image.pixels.chunks(image.width as usize).rev() {
        bytes.extend(row.iter().flatten().flat_map(|value| value.to_le_bytes()));
    }
    bytes
}

/// Colour (`PF`) and grey (`Pf`), of either byte order. The magnitude of the scale is a unit, and ignored.
pub(super) fn decode(bytes: &[u8]) -> Result<Image, PictureError> {
    let mut rest = bytes;
    let channels = match word(&mut rest) {
        Some("PF") => 3,
        Some("Pf") => 1,
        _ => return Err(PictureError::new("not a PFM: it does not begin with PF or Pf")),
    };
    let mut number = |what| {
        let text = word(&mut rest).unwrap_or("");
        text.parse::<f64>().map_err(|_| PictureError::new(format!("not a PFM: `{text}` is no {what}")))
    };
    let (width, height, scale) = (number("width")?, number("height")?, number("scale")?);
    let side = |value: f64| {
        (value >= 1.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0).then_some(value as u32)
    };
    let (Some(width), Some(height)) = (side(width), side(height)) else {
        return Err(PictureError::new(format!("a size of {width} by {height} is impossible")));
    };
    let pixels = plausible(width as usize, height as usize, bytes.len())?;
    let expected = pixels * channels * 4;
    if rest.len() < expected {
        let found = rest.len();
        return Err(PictureError::new(format!(
            "truncated: {expected} bytes of pixels expected, {found} found"
        )));
    }

    let value = |bytes: &[u8]| {
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if scale < 0.0 { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) }
    };
    let mut image = Image::black(width, height);
    let rows = rest.chunks_exact(width as usize * channels * 4);
    for (row, bytes) in image.pixels.chunks_exact_mut(width as usize).rev().zip(rows) {
        for (pixel, bytes) in row.iter_mut().zip(bytes.chunks_exact(channels * 4)) {
            *pixel = core::array::from_fn(|c| value(&bytes[(c % channels) * 4..]));
        }
    }
    Ok(image)
}

/// The next word of the header, with the one blank behind it: pixels may follow at once.
fn word<'a>(rest: &mut &'a [u8]) -> Option<&'a str> {
    let bytes = rest.trim_ascii_start();
    let length = bytes.iter().take(32).position(u8::is_ascii_whitespace)?;
    let (word, after) = bytes.split_at(length);
    *rest = &after[1..];
    core::str::from_utf8(word).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_big_endian_from_the_bottom() {
        let mut bytes = b"Pf\n1 2\n1.0\n".to_vec();
        bytes.extend([1.0f32, 2.0].iter().flat_map(|v| v.to_be_bytes()));
        assert_eq!(decode(&bytes).unwrap().pixels, [[2.0; 3], [1.0; 3]]);
    }

    #[test]
    fn a_first_pixel_that_looks_like_a_blank_is_kept() {
        let bytes = [b"Pf 1 1 -1\n".as_slice(), &[0x20, 0x20, 0x20, 0x20]].concat();
        assert_eq!(decode(&bytes).unwrap().pixels, [[f32::from_le_bytes([0x20; 4]); 3]]);
    }

    #[test]
    fn lies_about_the_size_are_refused() {
        for header in
            ["PF\n4000000000 4000000000\n-1\n", "PF\n9 9\n-1\n", "PF\n-1 1\n-1\n", "PF\n1 nan\n1\n", "P6\n"]
        {
            assert!(decode(header.as_bytes()).is_err(), "{header}");
        }
    }
}
