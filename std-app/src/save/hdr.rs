//! Radiance RGBE: three mantissas of 8 bits and a common exponent.

use super::{Image, PictureError};
use image::Rgb;
use image::codecs::hdr::HdrEncoder;

/// Largest value that RGBE holds.
const LARGEST: f32 = 255.0 / 256.0 * 1.701_411_8e38;

pub(super) fn encode(picture: &Image) -> Result<Vec<u8>, PictureError> {
    // `max` drops the NaN.
    let storable = |value: f32| value.clamp(0.0, LARGEST).max(0.0);
    let pixels: Vec<Rgb<f32>> = picture.pixels.iter().map(|pixel| Rgb(pixel.map(storable))).collect();
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes)
        .encode(&pixels, picture.width as usize, picture.height as usize)
        .map_err(PictureError::new)?;
    Ok(bytes)
}
