//! Pictures of a difference, as values and in false colours.

use super::heat::{heat, signed};
use super::{Comparison, Image};
use crate::save::from_srgb;

/// Content of a picture of the difference between A and its reference B.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Shown {
    /// A - B; as .png blue is too dark, red is too bright
    Signed,
    /// |A - B|
    Absolute,
    /// (A - B) / sqrt(B^2 + 0.01 m^2), m the mean of B, whose mean square is the relMSE
    Relative,
    /// LDR-FLIP error of each pixel, 0 to 1
    Flip,
}

impl Shown {
    /// Its name in flags and results.
    pub fn name(self) -> &'static str {
        match self {
            Shown::Signed => "signed",
            Shown::Absolute => "absolute",
            Shown::Relative => "relative",
            Shown::Flip => "flip",
        }
    }

    /// True if values may be negative.
    pub fn is_signed(self) -> bool {
        matches!(self, Shown::Signed | Shown::Relative)
    }
}

/// Fraction of pixels beyond the end of a scale, at most, so that outliers do not compress the scale.
const BEYOND: f64 = 0.005;

impl Comparison {
    /// The values of the difference; `image` and `reference` are the compared pictures.
    pub fn values(&self, image: &Image, reference: &Image, shown: Shown) -> Image {
        let floor = (0.01 * self.linear.reference_mean * self.linear.reference_mean) as f32;
        let value = |a: f32, b: f32| match shown {
            Shown::Signed => a - b,
            // 0 / 0, a black pixel of a black reference, is no error.
            Shown::Relative if a == b => 0.0,
            Shown::Relative => (a - b) / (b * b + floor).sqrt(),
            Shown::Absolute | Shown::Flip => (a - b).abs(),
        };
        let pixels = if shown == Shown::Flip {
            self.flip_map.iter().map(|&error| [error; 3]).collect()
        } else {
            let pairs = image.pixels.iter().zip(&reference.pixels);
            pairs.map(|(a, b)| core::array::from_fn(|c| value(a[c], b[c]))).collect()
        };
        Image { width: self.width, height: self.height, pixels }
    }
}

/// The mean of the channels of `values` in false colours, and the end e of the scale: −e ... e for signed
/// values, 0 ... e for others, 1 for FLIP.
pub fn false_colours(values: &Image, shown: Shown) -> (Image, f32) {
    let means: Vec<f32> = values.pixels.iter().map(|pixel| pixel.iter().sum::<f32>() / 3.0).collect();
    let end = if shown == Shown::Flip { 1.0 } else { scale_end(&means) };
    let colour = |&mean: &f32| {
        let relative = if mean == 0.0 { 0.0 } else { mean / end };
        (if shown.is_signed() { signed(relative) } else { heat(relative) }).map(from_srgb)
    };
    let pixels = means.iter().map(colour).collect();
    (Image { pixels, ..*values }, end)
}

/// The magnitude that all but [`BEYOND`] of the finite `values` do not exceed; 0 if there are none.
fn scale_end(values: &[f32]) -> f32 {
    let mut sizes: Vec<f32> = values.iter().map(|v| v.abs()).filter(|v| v.is_finite()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let index = ((sizes.len() - 1) as f64 * (1.0 - BEYOND)).ceil() as usize;
    *sizes.select_nth_unstable_by(index, f32::total_cmp).1
}
