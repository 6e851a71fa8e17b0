//! LDR-FLIP (Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020): the visible
//! difference of two pictures that alternate on a display. Values are clamped to [0, 1]; 67 pixels cover a
//! degree of vision: 3840 pixels on 0.7 m at a distance of 0.7 m, the default of the paper.
//!
//! 1. Colour: opponent channels blurred by the contrast sensitivity of the eye, then the HyAB distance of
//!    Hunt-adjusted L*a*b*, compressed to [0, 1].
//! 2. Features: first and second derivatives of the achromatic channel at the scale of visible detail.
//! 3. The colour error to the power of one minus the feature error.
//!
//! All kernels are separable (both terms of the blue-yellow one are), so they run along rows, then along
//! columns. The outermost pixels continue outside the picture.

use super::Image;
use core::f64::consts::PI;
use rayon::prelude::*;

type Colour = [f32; 3];

/// The FLIP error of each pixel, in [0, 1], of pictures of the same size. NaN counts as black.
pub fn flip(image: &Image, reference: &Image) -> Vec<f32> {
    Observer::of(reference).flip(image)
}

/// A filtered reference, to compare pictures of the same size with it.
pub struct Observer {
    filters: Filters,
    reference: Filtered,
}

impl Observer {
    /// Filters `reference`.
    pub fn of(reference: &Image) -> Self {
        let pixels_per_degree = 0.7 * 3840.0 / 0.7 * PI / 180.0;
        let filters = Filters::new(pixels_per_degree);
        let reference = filters.apply(reference);
        Self { filters, reference }
    }

    /// The FLIP error of each pixel of `image`.
    pub fn flip(&self, image: &Image) -> Vec<f32> {
        let (r, t) = (&self.reference, self.filters.apply(image));
        let largest = hyab(hunt(to_lab([0.0, 1.0, 0.0])), hunt(to_lab([0.0, 0.0, 1.0]))).powf(QC);
        let error = |index: usize| {
            let colour = redistribute(hyab(r.lab[index], t.lab[index]).powf(QC), largest);
            let edge = (r.edge[index] - t.edge[index]).abs();
            let point = (r.point[index] - t.point[index]).abs();
            // To the power of a half (section 4.2).
            let feature = (edge.max(point) * core::f32::consts::FRAC_1_SQRT_2).sqrt();
            colour.powf(1.0 - feature)
        };
        (0..image.pixels.len().min(r.lab.len())).into_par_iter().map(error).collect()
    }

    /// The mean FLIP error of `image`.
    pub fn mean(&self, image: &Image) -> f64 {
        mean(&self.flip(image))
    }
}

/// The mean of a FLIP map.
pub(super) fn mean(map: &[f32]) -> f64 {
    map.iter().map(|&error| f64::from(error)).sum::<f64>() / map.len().max(1) as f64
}

/// Exponent on the colour difference (section 4.1.3).
const QC: f32 = 0.7;

/// Differences below `PC` of the largest are mapped to 0 ... `PT`, larger ones to `PT` ... 1 (section 4.1.3).
const PC: f32 = 0.4;
const PT: f32 = 0.95;

fn redistribute(difference: f32, largest: f32) -> f32 {
    let knee = PC * largest;
    if difference < knee {
        difference * PT / knee
    } else {
        PT + (difference - knee) / (largest - knee) * (1.0 - PT)
    }
}

/// Contrast sensitivity (table 1): weights a and widths b of the Gaussians.
const ACHROMATIC: [(f64, f64); 1] = [(1.0, 0.0047)];
const RED_GREEN: [(f64, f64); 1] = [(1.0, 0.0053)];
const BLUE_YELLOW: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];

/// Full width of the smallest feature, in degrees.
const FEATURE: f64 = 0.082;

/// The filters of the eye.
struct Filters {
    /// Gaussians of each opponent channel along an axis; the filter is the sum of their outer products.
    sensitivity: [Vec<Vec<f32>>; 3],
    smooth: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

/// A filtered picture.
struct Filtered {
    lab: Vec<Colour>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Filters {
    fn new(pixels_per_degree: f64) -> Self {
        // Three standard deviations of the widest Gaussian.
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
        let sensitivity = |terms: &[(f64, f64)]| {
            let axis = |&(a, b): &(f64, f64)| -> Vec<f64> {
                let weight = (a * (PI / b).sqrt()).sqrt();
                let at = |x: i32| f64::from(x) / pixels_per_degree;
                (-radius..=radius).map(|x| weight * (-PI * PI * at(x) * at(x) / b).exp()).collect()
            };
            let axes: Vec<Vec<f64>> = terms.iter().map(axis).collect();
            let total: f64 = axes.iter().map(|axis| axis.iter().sum::<f64>().powi(2)).sum();
            axes.iter().map(|axis| axis.iter().map(|w| (w / total.sqrt()) as f32).collect()).collect()
        };

        let deviation = 0.5 * FEATURE * pixels_per_degree;
        let radius = (3.0 * deviation).ceil() as i32;
        let along = |weight: fn(f64, f64) -> f64| -> Vec<f64> {
            let gauss = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
            (-radius..=radius).map(|x| weight(x.into(), deviation) * gauss(x.into())).collect()
        };
        Self {
            sensitivity: [sensitivity(&ACHROMATIC), sensitivity(&RED_GREEN), sensitivity(&BLUE_YELLOW)],
            smooth: balanced(&along(|_, _| 1.0)),
            edge: balanced(&along(|x, _| -x)),
            point: balanced(&along(|x, deviation| x * x / (deviation * deviation) - 1.0)),
        }
    }

    fn apply(&self, picture: &Image) -> Filtered {
        let width = picture.width as usize;
        // Displayable values; `clamp` keeps NaN, `max` drops it.
        let shown = |pixel: &Colour| to_opponent(pixel.map(|c| c.clamp(0.0, 1.0).max(0.0)));
        let opponent: Vec<Colour> = picture.pixels.par_iter().map(shown).collect();
        let channel = |c: usize| opponent.iter().map(|colour| colour[c]).collect::<Vec<f32>>();

        let blurred: [Vec<f32>; 3] = core::array::from_fn(|c| {
            let channel = channel(c);
            let terms = self.sensitivity[c].iter().map(|axis| filter(&channel, width, axis, axis));
            terms.reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect()).unwrap_or(channel)
        });
        let lab = |i: usize| {
            let linear = from_opponent([blurred[0][i], blurred[1][i], blurred[2][i]]);
            hunt(to_lab(linear.map(|c| c.clamp(0.0, 1.0))))
        };

        // The achromatic channel, from [-16, 100] to [0, 1].
        let luma: Vec<f32> = channel(0).into_iter().map(|y| (y + 16.0) / 116.0).collect();
        let strength = |across: &[f32]| -> Vec<f32> {
            let x = filter(&luma, width, across, &self.smooth);
            let y = filter(&luma, width, &self.smooth, across);
            x.iter().zip(&y).map(|(x, y)| x.hypot(*y)).collect()
        };
        Filtered {
            lab: (0..opponent.len()).into_par_iter().map(lab).collect(),
            edge: strength(&self.edge),
            point: strength(&self.point),
        }
    }
}

/// Scales the positive weights to a sum of 1, and the negative ones to −1.
fn balanced(weights: &[f64]) -> Vec<f32> {
    let positive: f64 = weights.iter().filter(|&&w| w > 0.0).sum();
    let negative: f64 = -weights.iter().filter(|&&w| w < 0.0).sum::<f64>();
    weights.iter().map(|&w| (w / if w > 0.0 { positive } else { negative.max(1e-30) }) as f32).collect()
}

/// Filters `values` by `across` along the rows and by `down` along the columns. Each tap is applied to a
/// whole row, which vectorises.
fn filter(values: &[f32], width: usize, across: &[f32], down: &[f32]) -> Vec<f32> {
    let height = values.len() / width;
    let mut rows = vec![0.0; values.len()];
    let filter_row = |wide: &mut Vec<f32>, (to, from): (&mut [f32], &[f32])| {
        let (left, right) = (from[0], from[width - 1]);
        let radius = across.len() / 2;
        wide.clear();
        wide.resize(radius, left);
        wide.extend_from_slice(from);
        wide.resize(width + 2 * radius, right);
        for (k, w) in across.iter().enumerate() {
            to.iter_mut().zip(&wide[k..]).for_each(|(to, from)| *to += w * from);
        }
    };
    rows.par_chunks_mut(width)
        .with_min_len(ROWS)
        .zip(values.par_chunks(width))
        .for_each_init(Vec::new, filter_row);
    let mut columns = vec![0.0; values.len()];
    columns.par_chunks_mut(width).with_min_len(ROWS).enumerate().for_each(|(y, to)| {
        for (k, w) in down.iter().enumerate() {
            // The border rows continue outside.
            let row = (y + k).saturating_sub(down.len() / 2).min(height - 1);
            to.iter_mut().zip(&rows[row * width..][..width]).for_each(|(to, from)| *to += w * from);
        }
    });
    columns
}

/// Rows of a task, at least.
const ROWS: usize = 16;

/// Linear sRGB to XYZ, and XYZ of white (D65).
const TO_XYZ: [[f32; 3]; 3] = [
    [0.412_386_56, 0.357_591_5, 0.180_450_49],
    [0.212_636_82, 0.715_183, 0.072_180_2],
    [0.019_330_63, 0.119_197_16, 0.950_372_6],
];
const FROM_XYZ: [[f32; 3]; 3] = [
    [3.241_003_3, -1.537_399, -0.498_615_86],
    [-0.969_224_33, 1.875_930_1, 0.041_554_224],
    [0.055_639_423, -0.204_011_2, 1.057_148_9],
];
const WHITE: Colour = [0.950_428_54, 1.0, 1.088_900_4];

fn times(matrix: &[[f32; 3]; 3], v: Colour) -> Colour {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Linear sRGB to the linearised opponent space YCxCz.
fn to_opponent(linear: Colour) -> Colour {
    let xyz = times(&TO_XYZ, linear);
    let [x, y, z] = [xyz[0] / WHITE[0], xyz[1] / WHITE[1], xyz[2] / WHITE[2]];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([luma, cx, cz]: Colour) -> Colour {
    let y = (luma + 16.0) / 116.0;
    times(&FROM_XYZ, [(y + cx / 500.0) * WHITE[0], y * WHITE[1], (y - cz / 200.0) * WHITE[2]])
}

/// Linear sRGB to CIE L*a*b*.
fn to_lab(linear: Colour) -> Colour {
    const DELTA: f32 = 6.0 / 29.0;
    let compress = |t: f32| {
        if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let xyz = times(&TO_XYZ, linear);
    let [x, y, z] = core::array::from_fn(|c| compress(xyz[c] / WHITE[c]));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The Hunt effect: chroma increases with lightness.
fn hunt([l, a, b]: Colour) -> Colour {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// City-block distance in lightness, Euclidean in chroma, for large differences (Abasi et al. 2020).
fn hyab(r: Colour, t: Colour) -> f32 {
    (r[0] - t[0]).abs() + (r[1] - t[1]).hypot(r[2] - t[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::save::from_srgb;

    /// The published program computes its filters in another order of f32 operations.
    const TOLERANCE: f64 = 1e-4;

    const WIDTH: u32 = 61;
    const HEIGHT: u32 = 43;

    fn picture(value: impl Fn(u32, u32, u32) -> u32) -> Image {
        let channel = |x, y, c| from_srgb((value(x, y, c) % 256) as f32 / 255.0);
        let pixel = |x, y| [channel(x, y, 0), channel(x, y, 1), channel(x, y, 2)];
        let pixels = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
        Image { width: WIDTH, height: HEIGHT, pixels: pixels.map(|(x, y)| pixel(x, y)).collect() }
    }

    fn ramp(x: u32, y: u32, c: u32) -> u32 {
        (x * 3 + y * 2 * c) % 256
    }

    fn noise(x: u32, y: u32, c: u32) -> u32 {
        let hash = x.wrapping_mul(73856093) ^ y.wrapping_mul(19349663) ^ c.wrapping_mul(83492791);
        ((hash ^ (hash >> 15)).wrapping_mul(2246822519) >> 13) & 255
    }

    /// Values of the authors' program (Python package `flip-evaluator` 1.7, numpy arrays of these pictures
    /// divided by 255): `evaluate(reference, test, "LDR", applyMagma=False)` gives the map, here at column 30
    /// of row 20, and its mean.
    #[test]
    fn agrees_with_the_authors_program() {
        let noisy = |x, y, c| (ramp(x, y, c) + noise(x, y, c) / 8).min(255);
        let checkers = |moved: u32| move |x: u32, y: u32, _| 40 + 160 * (((x + moved) / 8 + y / 8) % 2);
        let pairs = [
            (picture(ramp), picture(noisy), 0.286_040_54, 0.294_854_5),
            (picture(|_, _, c| 255 * (c == 1) as u32), picture(|_, _, c| 255 * (c == 2) as u32), 1.0, 1.0),
            (picture(checkers(0)), picture(checkers(1)), 0.220_201_25, 0.415_078_22),
            (picture(noise), picture(|_, _, _| 128), 0.480_670_87, 0.494_359_7),
        ];
        for (number, (reference, test, mean, middle)) in pairs.into_iter().enumerate() {
            let map = flip(&test, &reference);
            let ours = super::mean(&map);
            assert!((ours - mean).abs() < TOLERANCE, "pair {number}: {ours} and {mean}");
            let ours = f64::from(map[20 * WIDTH as usize + 30]);
            assert!((ours - middle).abs() < TOLERANCE, "pair {number}, middle: {ours} and {middle}");
        }
    }

    #[test]
    fn observer_gives_the_same_map() {
        let observer = Observer::of(&picture(ramp));
        let other = picture(noise);
        let map = flip(&other, &picture(ramp));
        assert_eq!(observer.flip(&other), map);
        assert_eq!(observer.mean(&picture(ramp)), 0.0);
    }

    #[test]
    fn equal_pictures_have_no_error_and_one_pixel_suffices() {
        assert!(flip(&picture(noise), &picture(noise)).iter().all(|&error| error == 0.0));
        let dot = |value| Image { width: 1, height: 1, pixels: vec![[value; 3]] };
        assert!(flip(&dot(f32::NAN), &dot(f32::INFINITY)).iter().all(|error| error.is_finite()));
    }
}
