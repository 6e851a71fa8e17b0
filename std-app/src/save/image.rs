//! A picture in memory: linear RGB.

use super::from_srgb;
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
