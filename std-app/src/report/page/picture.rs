//! Pictures of a page as data: a PNG for display, and one with the radiance for the exposure slider.

use crate::save::{Image, to_srgb};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::{ExtendedColorType, ImageEncoder};
use maud::{Markup, html};

/// Larger pictures are reduced.
const MAX_PIXELS: usize = 1 << 21;

/// Narrower pictures are shown with sharp pixels.
const NARROW: u32 = 400;

/// Picture reduced by a whole factor, 1 up to 2^21 pixels; each pixel is the mean of a square.
pub(super) fn reduced(image: &Image) -> (Image, u32) {
    let mut factor = 1;
    while image.pixels.len() / (factor * factor) as usize > MAX_PIXELS {
        factor += 1;
    }
    let (width, height) = (image.width.div_ceil(factor), image.height.div_ceil(factor));
    let mut small = Image::black(width, height);
    for (index, pixel) in small.pixels.iter_mut().enumerate() {
        let (left, top) = (index as u32 % width * factor, index as u32 / width * factor);
        let (right, bottom) = ((left + factor).min(image.width), (top + factor).min(image.height));
        let square = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
        let weight = 1.0 / ((right - left) * (bottom - top)) as f32;
        for (x, y) in square {
            let from = image.pixels[y as usize * image.width as usize + x as usize];
            pixel.iter_mut().zip(from).for_each(|(sum, value)| *sum += value * weight);
        }
    }
    (small, factor)
}

/// `img` of the picture as a PNG shows it.
pub(super) fn img(image: &Image, alt: &str) -> Markup {
    element(image, alt, None)
}

/// `img` with the radiance, whose exposure can be changed.
pub(super) fn exposable(image: &Image, alt: &str) -> Markup {
    element(image, alt, Some(uri(image.width, 2 * image.height, &radiance(image))))
}

fn element(image: &Image, alt: &str, radiance: Option<String>) -> Markup {
    let Image { width, height, .. } = *image;
    let bytes: Vec<u8> =
        image.pixels.iter().flatten().map(|&value| (to_srgb(value) * 255.0 + 0.5) as u8).collect();
    let class = (width < NARROW).then_some("sharp");
    let source = uri(width, height, &bytes);
    html! {
        img class=[class] width=(width) height=(height) alt=(alt) src=(source) data-radiance=[radiance];
    }
}

/// Radiance in bytes: all mantissas, then three times all shared exponents (Ward 1991).
///
/// A value is mantissa · 2^(exponent − 136).
fn radiance(image: &Image) -> Vec<u8> {
    let shared = |pixel: &[f32; 3]| {
        let pixel = pixel.map(|value| if value.is_nan() { 0.0 } else { value.clamp(0.0, 1e30) });
        let most = pixel.into_iter().fold(0.0, f32::max);
        // Least e with most < 2^e; the exponent in the bits is e − 1 with a bias of 127.
        let exponent = (most.to_bits() >> 23) as i32 - 126;
        let scale = f64::from(8 - exponent).exp2();
        let mantissas = pixel.map(|value| (f64::from(value) * scale).round().min(255.0) as u8);
        (mantissas, (exponent + 128).clamp(0, 255) as u8)
    };
    let (mantissas, exponents): (Vec<_>, Vec<_>) = image.pixels.iter().map(shared).unzip();
    mantissas.into_iter().chain(exponents.into_iter().map(|e| [e; 3])).flatten().collect()
}

/// PNG of 8-bit RGB as a data URI; empty if the size does not fit into a PNG.
fn uri(width: u32, height: u32, bytes: &[u8]) -> String {
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let mut png = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut png, CompressionType::Default, FilterType::Adaptive);
    match encoder.write_image(bytes, width, height, ExtendedColorType::Rgb8) {
        Ok(()) => format!("data:image/png;base64,{}", STANDARD.encode(&png)),
        Err(_) => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radiance_keeps_eight_bits_of_any_range() {
        let values = [1e-20f32, 0.5, 1.0, 0.999, 3e4, 7e20];
        let pixels = values.map(|v| [v, v / 3.0, 0.0]).to_vec();
        let bytes = radiance(&Image { width: 6, height: 1, pixels });
        for (index, value) in values.into_iter().enumerate() {
            let scale = (f64::from(bytes[18 + 3 * index]) - 136.0).exp2();
            for (channel, expected) in [value, value / 3.0, 0.0].into_iter().enumerate() {
                let kept = f64::from(bytes[3 * index + channel]) * scale;
                assert!((kept - f64::from(expected)).abs() <= f64::from(value) / 200.0, "{expected}: {kept}");
            }
        }
        let odd = Image { width: 2, height: 1, pixels: vec![[f32::NAN, -1.0, 0.0], [f32::INFINITY; 3]] };
        assert_eq!(radiance(&odd)[..3], [0; 3]);
    }

    #[test]
    fn large_pictures_are_averaged() {
        let side = 1500;
        let pixels = (0..side * side).map(|i| [((i % side + i / side) % 2) as f32; 3]).collect();
        let (small, factor) = reduced(&Image { width: side, height: side, pixels });
        assert_eq!((factor, small.width, small.height), (2, 750, 750));
        assert!(small.pixels.iter().flatten().all(|&value| value == 0.5));
        let same = Image { width: 3, height: 1, pixels: vec![[1.0; 3]; 3] };
        assert_eq!(reduced(&same), (same, 1));
    }
}
