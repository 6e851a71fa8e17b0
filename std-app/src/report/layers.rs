//! Values of pixels for the page: pictures, their errors, and maps. The script derives all else from them.
//!
//! A layer is a list of 32-bit floats, pixel by pixel, with mantissas rounded to some bits. Its bytes are in
//! four planes, the most significant first, so that equal bytes are neighbours. They are compressed by zlib.

use super::Run;
use crate::render::{MapView, Mark, Survey};
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
    let (image, size) = (&result.image, [result.image.width, result.image.height]);
    let layer = |name, values: &Values<1>, bits| values.layer(Some(of), name, bits);
    let plane = |values: Vec<f32>| Values::of(size, values);
    let mut layers = vec![Values::picture(image).reduced().layer(Some(of), "picture", RADIANCE_BITS)];
    if result.error.is_some() {
        let errors = Values::picture(&result.variance).reduced().map(f32::sqrt);
        layers.push(errors.layer(Some(of), "error", ESTIMATE_BITS));
    }
    let [least, most] = [result.samples.iter().min(), result.samples.iter().max()];
    if most > least.map(|least| least + 1).as_ref() {
        let samples = plane(result.samples.iter().map(|&count| count as f32).collect());
        layers.push(layer("samples", &samples.reduced(), COUNT_BITS));
    }
    if let (Some(reference), Some(comparison)) = (run.reference(), run.comparison) {
        let flip = comparison.values(image, reference, crate::compare::Shown::Flip);
        let flip = plane(flip.pixels.iter().map(|&[value, ..]| value).collect());
        layers.push(layer("flip", &flip.reduced(), ESTIMATE_BITS));
    }
    if let Some(survey) = &result.survey {
        let covers =
            [survey.width, survey.pixels.len() as u32 / survey.width.max(1)].map(|n| n * survey.step);
        let maps = survey.pixels.iter().map(|pixel| {
            let mark = match pixel.mark {
                Mark::None => 0.0,
                Mark::Rim => 1.0,
                Mark::Record => 2.0,
            };
            [mark, pixel.radius, pixel.predicted]
        });
        let maps: Vec<_> = maps.collect();
        for (channel, name) in ["records", "radii", "predicted"].into_iter().enumerate() {
            let values = maps.iter().map(|values| [values[channel]]).collect();
            let values = Values { size: covers.map(|n| n / survey.step), covers, values };
            layers.push(layer(name, &values, ESTIMATE_BITS));
        }
        layers.push(layer("achieved", &plane(errors(size, survey)).reduced(), ESTIMATE_BITS));
    }
    let view = result.photon_view.iter();
    let maps = view.flat_map(|view| {
        let global = view.global.iter().map(|map| (["photons", "photon_density", "photon_radius"], map));
        let names = ["caustic_photons", "caustic_photon_density", "caustic_photon_radius"];
        global.chain(view.caustic.iter().map(move |map| (names, map))).map(|named| (view.width, named))
    });
    for (width, (names, MapView { positions, density, radius, seen })) in maps {
        for (name, values) in names.into_iter().zip([positions, density, radius]) {
            let map = Values::of([width, values.len() as u32 / width.max(1)], values.clone());
            let map = layer(name, &Values { covers: size, ..map }, ESTIMATE_BITS);
            layers.push(Layer { visible: Some(*seen), ..map });
        }
    }
    layers
}

/// Layer of a reference.
pub(super) fn of_reference(reference: &Image) -> Layer {
    Values::picture(reference).reduced().layer(None, "picture", RADIANCE_BITS)
}

/// Relative errors at the test points of a survey, one square each.
fn errors([width, height]: [u32; 2], survey: &Survey) -> Vec<f32> {
    let mut values = vec![0.0; width as usize * height as usize];
    for check in &survey.checks {
        let [x, y] = check.pixel;
        let right = (x + survey.square).min(width);
        for row in y..(y + survey.square).min(height) {
            let row = row as usize * width as usize;
            values[row + x as usize..row + right as usize].fill(check.error);
        }
    }
    values
}

/// Values of pixels before compression.
struct Values<const N: usize> {
    size: [u32; 2],
    covers: [u32; 2],
    values: Vec<[f32; N]>,
}

impl Values<1> {
    fn of(size: [u32; 2], values: Vec<f32>) -> Self {
        Self { size, covers: size, values: values.into_iter().map(|value| [value]).collect() }
    }
}

impl Values<3> {
    fn picture(image: &Image) -> Self {
        let size = [image.width, image.height];
        Self { size, covers: size, values: image.pixels.clone() }
    }
}

impl<const N: usize> Values<N> {
    /// Values reduced by a whole factor, 1 up to 2^21 pixels; each value is the mean of a square.
    fn reduced(self) -> Self {
        let mut factor = 1;
        while self.values.len() / (factor * factor) as usize > MAX_PIXELS {
            factor += 1;
        }
        if factor == 1 {
            return self;
        }
        let [full, rows] = self.size;
        let [width, height] = self.size.map(|n| n.div_ceil(factor));
        let pixel = |index: u32| {
            let (left, top) = (index % width * factor, index / width * factor);
            let (right, bottom) = ((left + factor).min(full), (top + factor).min(rows));
            let square = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
            let weight = 1.0 / ((right - left) * (bottom - top)) as f32;
            square.fold([0.0; N], |sum, (x, y)| {
                let value = self.values[y as usize * full as usize + x as usize];
                core::array::from_fn(|channel| sum[channel] + value[channel] * weight)
            })
        };
        let values = (0..width * height).map(pixel).collect();
        Self { size: [width, height], covers: [width * factor, height * factor], values }
    }

    fn map(mut self, function: impl Fn(f32) -> f32) -> Self {
        self.values.iter_mut().flatten().for_each(|value| *value = function(*value));
        self
    }

    fn layer(&self, of: Option<usize>, name: &'static str, bits: u32) -> Layer {
        let [width, height] = self.size;
        let data = encoded(self.values.as_flattened(), bits);
        Layer { of, name, width, height, covers: self.covers, channels: N, visible: None, data }
    }
}

/// Values with mantissas of `bits` bits, in planes of bytes, by zlib and in base 64.
fn encoded(values: &[f32], bits: u32) -> String {
    let words: Vec<u32> = values.iter().map(|&value| rounded(value, bits)).collect();
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    let mut bytes = Vec::with_capacity(words.len());
    for shift in [24, 16, 8, 0] {
        bytes.clear();
        bytes.extend(words.iter().map(|word| (word >> shift) as u8));
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
        let side = 1500;
        let pixels = (0..side * side).map(|i| [((i % side + i / side) % 2) as f32; 3]).collect();
        let small = Values::picture(&Image { width: side, height: side, pixels }).reduced();
        assert_eq!((small.size, small.covers), ([750, 750], [1500, 1500]));
        assert!(small.values.iter().flatten().all(|&value| value == 0.5));
        let same = Values::of([3, 1], vec![1.0; 3]).reduced();
        assert_eq!((same.size, same.covers), ([3, 1], [3, 1]));
    }
}
