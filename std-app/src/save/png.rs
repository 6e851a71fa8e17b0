//! PNG: pictures for the eye. Tone mapping is a clamp to [0, 1] and the sRGB curve, nothing else.

use super::{Image, PictureError};
use image::{ExtendedColorType, ImageEncoder};

/// Linear value to display value in [0, 1] (IEC 61966-2-1). Not a number becomes 0.
pub fn to_srgb(linear: f32) -> f32 {
    // `clamp` keeps a NaN, `max` drops it.
    let linear = linear.clamp(0.0, 1.0).max(0.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Display value to linear value, the inverse of [`to_srgb`].
pub fn from_srgb(display: f32) -> f32 {
    if display <= 0.040_45 { display / 12.92 } else { ((display + 0.055) / 1.055).powf(2.4) }
}

pub(super) fn encode(picture: &Image) -> Result<Vec<u8>, PictureError> {
    let display = |&value: &f32| (to_srgb(value) * 255.0 + 0.5) as u8;
    let samples: Vec<u8> = picture.pixels.iter().flatten().map(display).collect();
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(&samples, picture.width, picture.height, ExtendedColorType::Rgb8)
        .map_err(PictureError::new)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_has_its_published_values_and_inverts() {
        for (linear, display) in
            [(0.0, 0), (0.5, 188), (0.18, 118), (1.0, 255), (7.0, 255), (-1.0, 0), (f32::NAN, 0)]
        {
            assert_eq!((to_srgb(linear) * 255.0 + 0.5) as u8, display, "{linear}");
        }
        for byte in 0..=255u8 {
            let display = f32::from(byte) / 255.0;
            assert!((to_srgb(from_srgb(display)) - display).abs() < 1e-6);
        }
    }
}
