//! Values of pixels for the page: pictures, their errors, and maps. The script derives all else from them.
//!
//! A layer is a list of 32-bit floats, pixel by pixel, with mantissas rounded to some bits. Its bytes are in
//! four planes, the most significant first, so that equal bytes are neighbours. They are compressed by zlib.

use super::Run;
use crate::compare::Shown;
use crate::render::{Mark, Survey, SurveyPixel};
use crate::save::Image;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;
use std::io::Write;

/// Larger pictures are reduced.
const MAX_PIXELS: usize = 1 << 21;

/// Bits of the mantissas of radiance, which are compared with a reference.
const RADIANCE_BITS: u32 = 12;

/// Bits of the mantissas of estimates.
const ESTIMATE_BITS: u32 = 6;

/// Bits of the mantissas of counts: all.
const COUNT_BITS: u32 = 23;

/// Names of the layers of a photon map: photons of a pixel, their density and their radius.
const PHOTONS: [&str; 3] = ["photons", "photon_density", "photon_radius"];
const CAUSTIC_PHOTONS: [&str; 3] = ["caustic_photons", "caustic_photon_density", "caustic_photon_radius"];

/// Values of the pixels of a picture.
#[derive(Serialize)]
pub(super) struct Layer {
    /// Index of the method; none for the reference.
    of: Option<usize>,
    name: &'static str,
    width: u32,
    height: u32,
    /// Columns and rows of the picture below the layer; the last ones may be beyond its border.
    covers: [u32; 2],
    /// Values of a pixel.
    channels: usize,
    /// Fraction of the photons of a map that the camera sees.
    visible: Option<f64>,
    data: String,
}

/// Layers of the render `of`.
pub(super) fn of_run(run: &Run, of: usize) -> Vec<Layer> {
    let result = run.result;
    let image = &result.image;
    let size = [image.width, image.height];
    let mut layers = vec![picture("picture", image, RADIANCE_BITS)];
    if result.error.is_some() {
        layers.push(picture("variances", &result.variance, ESTIMATE_BITS));
    }
    let [least, most] = [result.samples.iter().min(), result.samples.iter().max()];
    if most > least.map(|least| least + 1).as_ref() {
        let samples: Vec<f32> = result.samples.iter().map(|&count| count as f32).collect();
        layers.push(Layer::new("samples", size, 1, &samples, COUNT_BITS));
    }
    if let (Some(reference), Some(comparison)) = (run.reference(), run.comparison) {
        let flip = comparison.values(image, reference, Shown::Flip);
        let flip: Vec<f32> = flip.pixels.iter().map(|&[value, ..]| value).collect();
        layers.push(Layer::new("flip", size, 1, &flip, ESTIMATE_BITS));
    }
    layers.extend(result.survey.iter().flat_map(|survey| of_survey(survey, size)));
    if let Some(view) = &result.photon_view {
        let maps = [(PHOTONS, &view.global), (CAUSTIC_PHOTONS, &view.caustic)];
        for (names, map) in maps.into_iter().filter_map(|(names, map)| Some((names, map.as_ref()?))) {
            let planes = [&map.positions, &map.density, &map.radius];
            layers.extend(names.into_iter().zip(planes).map(|(name, values)| {
                let height = values.len() as u32 / view.width.max(1);
                let layer = Layer::new(name, [view.width, height], 1, values, ESTIMATE_BITS);
                Layer { covers: size, visible: Some(map.seen), ..layer }
            }));
        }
    }
    layers.iter_mut().for_each(|layer| layer.of = Some(of));
    layers
}

/// Layer of a reference.
pub(super) fn of_reference(reference: &Image) -> Layer {
    picture("picture", reference, RADIANCE_BITS)
}

fn picture(name: &'static str, image: &Image, bits: u32) -> Layer {
    Layer::new(name, [image.width, image.height], 3, image.pixels.as_flattened(), bits)
}

/// Maps of the pixels of a survey, and the relative errors at its test points, one square each.
fn of_survey(survey: &Survey, [width, height]: [u32; 2]) -> Vec<Layer> {
    let size = [survey.width, survey.pixels.len() as u32 / survey.width.max(1)];
    let covers = size.map(|pixels| pixels * survey.step);
    let map = |name, of: fn(&SurveyPixel) -> f32| {
        let values: Vec<f32> = survey.pixels.iter().map(of).collect();
        Layer { covers, ..Layer::new(name, size, 1, &values, ESTIMATE_BITS) }
    };
    let mut errors = vec![0.0; width as usize * height as usize];
    for check in &survey.checks {
        let [x, y] = check.pixel;
        let right = (x + survey.square).min(width);
        for row in y..(y + survey.square).min(height) {
            let row = row as usize * width as usize;
            errors[row + x as usize..row + right as usize].fill(check.error);
        }
    }
    vec![
        map("records", |pixel| match pixel.mark {
            Mark::None => 0.0,
            Mark::Rim => 1.0,
            Mark::Record => 2.0,
        }),
        map("radii", |pixel| pixel.radius),
        map("predicted", |pixel| pixel.predicted),
        Layer::new("achieved", [width, height], 1, &errors, ESTIMATE_BITS),
    ]
}

impl Layer {
    /// Layer of a picture of `size`, reduced by a whole factor if it is large.
    fn new(name: &'static str, size: [u32; 2], channels: usize, values: &[f32], bits: u32) -> Self {
        let factor = factor(size);
        let [width, height] = size.map(|pixels| pixels.div_ceil(factor));
        let covers = [width, height].map(|pixels| pixels * factor);
        let data = encoded(&reduced(values, size, channels, factor), bits);
        Self { of: None, name, width, height, covers, channels, visible: None, data }
    }
}

/// Least factor by which a picture has at most 2^21 pixels.
fn factor([width, height]: [u32; 2]) -> u32 {
    let fits =
        |factor: &u32| width.div_ceil(*factor) as usize * height.div_ceil(*factor) as usize <= MAX_PIXELS;
    (1..).find(fits).unwrap_or(u32::MAX)
}

/// Means over squares of `factor` × `factor` pixels.
fn reduced(values: &[f32], [width, height]: [u32; 2], channels: usize, factor: u32) -> Vec<f32> {
    let mut means = Vec::new();
    for (top, left) in (0..height)
        .step_by(factor as usize)
        .flat_map(|top| (0..width).step_by(factor as usize).map(move |left| (top, left)))
    {
        let (right, bottom) = ((left + factor).min(width), (top + factor).min(height));
        let weight = 1.0 / ((right - left) * (bottom - top)) as f32;
        means.extend((0..channels).map(|channel| {
            let square = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
            let at = |(x, y)| values[(y as usize * width as usize + x as usize) * channels + channel];
            square.map(at).sum::<f32>() * weight
        }));
    }
    means
}

/// Values with mantissas of `bits` bits, in planes of bytes, by zlib and in base 64.
fn encoded(values: &[f32], bits: u32) -> String {
    let words = || values.iter().map(|&value| rounded(value, bits));
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    for shift in [24, 16, 8, 0] {
        let bytes: Vec<u8> = words().map(|word| (word >> shift) as u8).collect();
        // Writing to a vector does not fail.
        let _ = encoder.write_all(&bytes);
    }
    STANDARD.encode(encoder.finish().unwrap_or_default())
}

/// Bits of the nearest float with a mantissa of `bits` bits.
fn rounded(value: f32, bits: u32) -> u32 {
    let dropped = 23 - bits;
    let word = value.to_bits();
    if !value.is_finite() || dropped == 0 {
        word
    } else {
        (word + (1 << (dropped - 1))) >> dropped << dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::read::ZlibDecoder;
    use std::io::Read;

    #[test]
    fn layers_keep_the_bits_that_they_state() {
        let values = [1e-20f32, 0.5, 1.0, 0.999_999, -3e4, 7e20, 0.0, 16_777_215.0, f32::INFINITY];
        for bits in [ESTIMATE_BITS, RADIANCE_BITS, COUNT_BITS] {
            let mut planes = Vec::new();
            let data = STANDARD.decode(encoded(&values, bits)).unwrap();
            ZlibDecoder::new(data.as_slice()).read_to_end(&mut planes).unwrap();
            let count = values.len();
            assert_eq!(planes.len(), 4 * count);
            for (index, value) in values.into_iter().enumerate() {
                let word = [0, 1, 2, 3].map(|plane| planes[plane * count + index]);
                let kept = f32::from_be_bytes(word);
                let bound = value.abs() * 0.5f32.powi(bits as i32 + 1);
                assert!(kept == value || (kept - value).abs() <= bound, "{bits}: {value} {kept}");
            }
        }
    }

    #[test]
    fn large_pictures_are_averaged() {
        let pixels: Vec<f32> = (0..1500 * 1500).map(|i| ((i % 1500 + i / 1500) % 2) as f32).collect();
        assert_eq!((factor([1500, 1500]), factor([1 << 11, 1 << 10]), factor([1 << 20, 3])), (2, 1, 2));
        let small = reduced(&pixels, [1500, 1500], 1, 2);
        assert!(small.len() == 750 * 750 && small.iter().all(|&value| value == 0.5));
        let odd = reduced(&[1.0, 4.0, 2.0, 5.0, 3.0, 6.0], [3, 1], 2, 2);
        assert_eq!(odd, [1.5, 4.5, 3.0, 6.0]);
    }
}
