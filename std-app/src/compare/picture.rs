//! Pictures of a difference: what is shown, and the false colours in which a PNG shows it.

use super::heat::{heat, signed};
use super::{Comparison, Image};
use crate::save::from_srgb;

/// What a picture of the difference between A and its reference B shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// A − B.
    Signed,
    /// |A − B|.
    Absolute,
    /// (A − B) / √(B² + 0.01 m²), m the mean of B: the mean of its square is the relMSE.
    Relative,
    /// The LDR-FLIP error of each pixel, in [0, 1].
    Flip,
}

impl Shown {
    /// Whether it has values below zero.
    pub fn is_signed(self) -> bool {
        matches!(self, Shown::Signed | Shown::Relative)
    }
}

/// Largest share of pixels that a scale of false colours leaves beyond its end: a few outliers should not make
/// all others look alike.
const BEYOND: f64 = 0.005;

impl Comparison {
    /// The values of the difference between the pictures that were compared.
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

/// `values` of a difference in false colours, by the mean of the channels, and the value at the end of the
/// scale: blue to red from minus that for signed ones, black to yellow from 0 for the others. That of FLIP
/// is 1.
pub fn false_colours(values: &Image, shown: Shown) -> (Image, f32) {
    let means: Vec<f32> = values.pixels.iter().map(|pixel| pixel.iter().sum::<f32>() / 3.0).collect();
    let end = if shown == Shown::Flip { 1.0 } else { scale_end(&means) };
    let colour = |&mean: &f32| {
        let place = if mean == 0.0 { 0.0 } else { mean / end };
        (if shown.is_signed() { signed(place) } else { heat(place) }).map(from_srgb)
    };
    let pixels = means.iter().map(colour).collect();
    (Image { pixels, ..*values }, end)
}

/// What all but [`BEYOND`] of the finite `values` are at most, whatever their sign; 0 where there are none.
fn scale_end(values: &[f32]) -> f32 {
    let mut sizes: Vec<f32> = values.iter().map(|v| v.abs()).filter(|v| v.is_finite()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let place = ((sizes.len() - 1) as f64 * (1.0 - BEYOND)).ceil() as usize;
    *sizes.select_nth_unstable_by(place, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::super::compare;
    use super::*;

    #[test]
    fn the_relative_difference_squares_to_the_relmse() {
        let picture = |values: [f32; 3]| Image { width: 3, height: 1, pixels: values.map(|v| [v; 3]).into() };
        let (a, b) = (picture([1.0, 2.0, 0.0]), picture([2.0, 1.5, 0.0]));
        let comparison = compare(&a, &b).unwrap();
        let of = |shown| comparison.values(&a, &b, shown).pixels.iter().map(|p| p[0]).collect::<Vec<_>>();
        assert_eq!(of(Shown::Signed), [-1.0, 0.5, 0.0]);
        assert_eq!(of(Shown::Absolute), [1.0, 0.5, 0.0]);
        let squares = of(Shown::Relative).iter().map(|&v| f64::from(v * v)).sum::<f64>() / 3.0;
        assert!((squares - comparison.linear.relmse).abs() < 1e-7);
        assert!(of(Shown::Flip).iter().all(|error| (0.0..=1.0).contains(error)));
    }

    #[test]
    fn false_colours_tell_the_sign_and_ignore_outliers() {
        let mut values = Image { width: 1000, height: 1, pixels: vec![[0.5; 3]; 1000] };
        values.pixels[0] = [1e9; 3];
        values.pixels[1] = [f32::NAN; 3];
        values.pixels[2] = [-0.5; 3];
        let (colours, end) = false_colours(&values, Shown::Signed);
        assert_eq!(end, 0.5);
        let [red, _, blue] = colours.pixels[3];
        assert!(red > blue, "above zero is red");
        let [red, _, blue] = colours.pixels[2];
        assert!(blue > red, "below zero is blue");
        let flat = false_colours(&Image::black(2, 2), Shown::Absolute);
        assert!(flat.1 == 0.0 && flat.0.pixels.iter().flatten().all(|c| c.is_finite()));
    }
}
