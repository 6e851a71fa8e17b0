//! A picture in memory: linear RGB, and the curve of sRGB.

use crate::picture::{Picture, Samples};
use halflight_core::Rgb;

/// Linear radiance of `width * height` pixels, in rows from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A black picture.
    pub fn black(width: u32, height: u32) -> Self {
        Self { width, height, pixels: vec![[0.0; 3]; width as usize * height as usize] }
    }

    /// The pixels as the core's colours.
    pub fn colours(&self) -> impl Iterator<Item = Rgb> + Clone + '_ {
        self.pixels.iter().map(|&pixel| Rgb::from_array(pixel))
    }

    /// Mean of each channel over the pixels that are finite.
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut count = 0u64;
        for pixel in self.pixels.iter().filter(|pixel| pixel.iter().all(|c| c.is_finite())) {
            count += 1;
            for (sum, &channel) in sum.iter_mut().zip(pixel) {
                *sum += f64::from(channel);
            }
        }
        sum.map(|sum| sum / count.max(1) as f64)
    }
}

/// Linear colours: integers pass through the inverse sRGB curve. Alpha is ignored.
impl From<Picture> for Image {
    fn from(picture: Picture) -> Self {
        let pixels = match picture.samples {
            Samples::Floats { rgb, .. } => rgb,
            Samples::Bytes(samples) => {
                let table: [f32; 256] = core::array::from_fn(|byte| from_srgb(byte as f32 / 255.0));
                let pixel = |rgba: &[u8]| [0, 1, 2].map(|c: usize| table[usize::from(rgba[c])]);
                samples.chunks_exact(4).map(pixel).collect()
            }
            Samples::Words(samples) => {
                let pixel = |rgba: &[u16]| [0, 1, 2].map(|c: usize| from_srgb(f32::from(rgba[c]) / 65535.0));
                samples.chunks_exact(4).map(pixel).collect()
            }
        };
        Self { width: picture.width, height: picture.height, pixels }
    }
}

/// Linear value to display value in [0, 1] (IEC 61966-2-1); 0 for NaN.
pub fn to_srgb(linear: f32) -> f32 {
    // `clamp` keeps NaN, `max` drops it.
    let linear = linear.clamp(0.0, 1.0).max(0.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Linear value to the byte of a display.
pub fn display_byte(linear: f32) -> u8 {
    (to_srgb(linear) * 255.0 + 0.5) as u8
}

/// Display value to linear value, the inverse of [`to_srgb`].
pub fn from_srgb(display: f32) -> f32 {
    if display <= 0.040_45 { display / 12.92 } else { ((display + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_curve_has_published_values_and_inverts() {
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
