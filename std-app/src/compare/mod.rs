//! Comparison of two pictures: errors in linear light, visible differences (FLIP), and pictures of the
//! difference.

mod flip;
pub(crate) mod heat;
mod picture;

pub use flip::{Observer, flip};
pub use picture::{Shown, false_colours};

use crate::save::Image;
use core::fmt;
use halflight_core::estimate::Difference;

/// Result of [`compare`].
#[derive(Clone, Debug)]
pub struct Comparison {
    /// MSE, relMSE, means, and the number of pixels that are not finite.
    pub linear: Difference,
    /// Mean of the LDR-FLIP map: 0 is no visible difference, 1 the largest; NaN if no pixel is finite.
    pub flip: f64,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    flip_map: Vec<f32>,
}

/// Two pictures differ in size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SizeMismatch {
    /// Width and height of the picture.
    pub image: [u32; 2],
    /// Width and height of the reference.
    pub reference: [u32; 2],
}

impl fmt::Display for SizeMismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([a, b], [c, d]) = (self.image, self.reference);
        write!(f, "the pictures differ in size: {a}x{b} and {c}x{d}")
    }
}

impl core::error::Error for SizeMismatch {}

/// Bytes that [`compare`] takes for pictures of the size of `image`, without the pictures: filtered planes.
pub fn working_bytes(image: &Image) -> usize {
    const OF_PIXEL: usize = 84;
    image.pixels.len().saturating_mul(OF_PIXEL)
}

/// Compares `image` with `reference`.
///
/// # Errors
/// The sizes differ.
pub fn compare(image: &Image, reference: &Image) -> Result<Comparison, SizeMismatch> {
    if (image.width, image.height) != (reference.width, reference.height) {
        let size = |image: &Image| [image.width, image.height];
        return Err(SizeMismatch { image: size(image), reference: size(reference) });
    }
    let flip_map = flip(image, reference);
    let linear = Difference::between(image.colours(), reference.colours());
    Ok(Comparison {
        linear,
        flip: visible(&linear, flip::mean(&flip_map)),
        width: image.width,
        height: image.height,
        flip_map,
    })
}

/// The mean FLIP error `flip`; NaN if no pixel of both pictures is finite, since there is nothing to compare.
pub(crate) fn visible(linear: &Difference, flip: f64) -> f64 {
    if linear.pixels == 0 { f64::NAN } else { flip }
}
