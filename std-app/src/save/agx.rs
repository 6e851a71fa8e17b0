//! AgX (Sobotka 2022) as Blender shows it: a table of three dimensions over the logarithms of E-Gamut, whose
//! entries are computed where a colour needs them. Between few entries the table differs from its formulas by
//! up to 10 of 255 in dark channels of saturated colours.

/// Linear value of middle grey.
pub(super) const GREY: f64 = 0.18;

type Matrix = [[f32; 3]; 3];

/// Linear sRGB to linear E-Gamut of FilmLight, and that to Rec. 2020.
const TO_E_GAMUT: Matrix = [
    [0.559_371_1, 0.304_783_34, 0.135_845_56],
    [0.076_220_7, 0.787_971_8, 0.135_807_5],
    [0.065_526_7, 0.164_546_8, 0.769_926_5],
];
const TO_REC_2020: Matrix = [
    [1.137_580_8, 0.008_350_39, -0.145_931_2],
    [-0.019_087_4, 1.215_335_2, -0.196_247_8],
    [-0.097_311_1, -0.100_873_2, 1.198_184_3],
];
/// Rec. 2020 to linear sRGB.
const FROM_REC_2020: Matrix = [
    [1.660_491, -0.587_641_1, -0.072_849_86],
    [-0.124_550_48, 1.132_899_9, -0.008_349_42],
    [-0.018_150_76, -0.100_578_9, 1.118_729_7],
];

/// Luminances of the primaries.
const REC_2020: [f32; 3] = [0.262_698_34, 0.677_999_7, 0.059_302];
const SRGB: [f32; 3] = [0.212_672_9, 0.715_152_2, 0.072_175];

/// Primaries moved inwards, by which bright colours lose their saturation; and back, less.
const INSET: Matrix = [
    [0.856_627_15, 0.095_121_24, 0.048_251_606],
    [0.137_318_97, 0.761_242, 0.101_439_04],
    [0.111_898_21, 0.076_799_42, 0.811_302_37],
];
const OUTSET: Matrix = [
    [1.127_100_6, -0.110_606_64, -0.016_493_939],
    [-0.141_329_76, 1.157_823_7, -0.016_493_939],
    [-0.141_329_76, -0.110_606_64, 1.251_936_4],
];

/// Stops of the first entry from 1, of all entries, and of the sigmoid: 10 below and 6.5 above middle grey.
const DARKEST: f32 = -12.473_93;
const STOPS: f32 = 25.0;
const SIGMOID_STOPS: f32 = 16.5;

/// Steps between the entries along an axis.
const STEPS: f32 = 56.0;

/// Exponent of the display in the table.
const DISPLAY: f32 = 2.4;

/// Part of the hue before the curve in the hue after it.
const OLD_HUE: f32 = 0.6;

/// Linear sRGB on the display: tetrahedral interpolation of the table.
pub(super) fn agx(color: [f32; 3]) -> [f32; 3] {
    let position =
        times(&TO_E_GAMUT, color).map(|x| STEPS * ((x.max(1e-10).log2() - DARKEST) / STOPS).clamp(0.0, 1.0));
    let mut corner = position.map(|x| x.floor().min(STEPS - 1.0));
    let fractions: [f32; 3] = core::array::from_fn(|i| position[i] - corner[i]);
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| fractions[b].total_cmp(&fractions[a]));
    let [first, second, third] = axes.map(|axis| fractions[axis]);
    let mut sum = [0.0; 3];
    for (step, weight) in [1.0 - first, first - second, second - third, third].into_iter().enumerate() {
        if weight > 0.0 {
            let entry = entry(corner);
            sum = core::array::from_fn(|i| sum[i] + weight * entry[i]);
        }
        axes.get(step).into_iter().for_each(|&axis| corner[axis] += 1.0);
    }
    sum.map(|channel| channel.powf(DISPLAY))
}

/// Entry of the table at steps along its axes: a colour of the display, encoded.
fn entry(steps: [f32; 3]) -> [f32; 3] {
    let linear = steps.map(|step| (STOPS / STEPS * step + DARKEST).exp2());
    let inset = times(&INSET, within_gamut(times(&TO_REC_2020, linear), REC_2020));
    let logarithm = inset.map(|x| (x.max(1e-10).log2() - DARKEST) / SIGMOID_STOPS);
    let formed = logarithm.map(|x| sigmoid(x.clamp(0.0, 1.0)).max(0.0).powf(DISPLAY));
    let formed = times(&FROM_REC_2020, times(&OUTSET, with_hue(formed, inset)));
    within_gamut(formed, SRGB).map(|channel| channel.clamp(0.0, 1.0).powf(1.0 / DISPLAY))
}

fn times(matrix: &Matrix, [x, y, z]: [f32; 3]) -> [f32; 3] {
    matrix.map(|[a, b, c]| a * x + b * y + c * z)
}

/// `color` without negative channels: white is added, and its luminance with that of its complement is kept.
fn within_gamut(color: [f32; 3], luminances: [f32; 3]) -> [f32; 3] {
    let least = color.into_iter().fold(0.0, f32::min);
    let luminance = |[r, g, b]: [f32; 3]| luminances[0] * r + luminances[1] * g + luminances[2] * b;
    let level = |color: [f32; 3]| {
        let most = color.into_iter().fold(f32::NEG_INFINITY, f32::max);
        let complement = color.map(|channel| most - channel);
        complement.into_iter().fold(0.0, f32::max) - luminance(complement) + luminance(color)
    };
    let lifted = color.map(|channel| channel - least);
    let (wanted, found) = (level(color), level(lifted));
    let factor = if found > wanted { (wanted / found).max(0.0) } else { 1.0 };
    lifted.map(|channel| factor * channel)
}

/// The curve of AgX from logarithm to display, with slope 2.4 at middle grey and powers of 1.5 beside it.
fn sigmoid(x: f32) -> f32 {
    const SLOPE: f32 = 2.4;
    const POWER: f32 = 1.5;
    let (pivot, grey) = (10.0 / SIGMOID_STOPS, (GREY as f32).powf(1.0 / DISPLAY));
    let scale =
        |x: f32, y: f32| ((SLOPE * x).powf(-POWER) * ((SLOPE * x / y).powf(POWER) - 1.0)).powf(-1.0 / POWER);
    let scale = if x < pivot { -scale(pivot, grey) } else { scale(1.0 - pivot, 1.0 - grey) };
    let from_pivot = SLOPE * (x - pivot) / scale;
    scale * from_pivot / (1.0 + from_pivot.powf(POWER)).powf(1.0 / POWER) + grey
}

/// `color` with a hue that lies between its own and that of `old`.
fn with_hue(color: [f32; 3], old: [f32; 3]) -> [f32; 3] {
    let most = color.into_iter().fold(0.0, f32::max);
    let least = color.into_iter().fold(f32::INFINITY, f32::min);
    let (Some(hue), Some(old)) = (hue(color), hue(old)) else { return color };
    let turn = (old - hue + 3.0).rem_euclid(6.0) - 3.0;
    let hue = hue + OLD_HUE * turn;
    // From HSV (Smith 1978).
    [5.0, 3.0, 1.0].map(|first: f32| {
        let k = (first + hue).rem_euclid(6.0);
        most - (most - least) * k.min(4.0 - k).clamp(0.0, 1.0)
    })
}

/// Hue in sixths of a turn; `None` for grey.
fn hue([r, g, b]: [f32; 3]) -> Option<f32> {
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    let range = most - least;
    (range > 0.0).then(|| match most {
        _ if most == r => (g - b) / range,
        _ if most == g => (b - r) / range + 2.0,
        _ => (r - g) / range + 4.0,
    })
}
