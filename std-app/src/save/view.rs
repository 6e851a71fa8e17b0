//! View of a picture on a display: exposure, and a curve that brings bright colours into its range.

use super::Image;
use super::agx::{GREY, agx};
use core::str::FromStr;
use std::borrow::Cow;

/// Curve from exposed radiance to the display, which shows 0 … 1 of linear sRGB.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curve {
    /// Channels above 1 are cut.
    #[default]
    Clamp,
    /// Khronos PBR Neutral (2024): colours below 0.8 are shown as they are, minus the light of a Fresnel
    /// reflection of 0.04; brighter ones are compressed and desaturated.
    Neutral,
    /// AgX (Sobotka 2022) as Blender shows it: 16.5 stops around middle grey along a sigmoid, in primaries by
    /// which bright colours become white.
    Agx,
}

/// Exposure and curve of a view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewTransform {
    /// Stops by which the picture is brightened: factors of 2.
    pub stops: f32,
    /// Curve after that.
    pub curve: Curve,
}

impl FromStr for Curve {
    type Err = ();

    fn from_str(name: &str) -> Result<Self, ()> {
        match name {
            "clamp" => Ok(Self::Clamp),
            "neutral" => Ok(Self::Neutral),
            "agx" => Ok(Self::Agx),
            _ => Err(()),
        }
    }
}

/// Largest exposure of [`automatic_stops`], in either direction.
const MOST_STOPS: f64 = 40.0;

/// Stops that bring the geometric mean of the luminances to middle grey (Reinhard et al. 2002); 0 if nothing
/// is bright. Black pixels do not count.
pub fn automatic_stops(image: &Image) -> f32 {
    let (mut sum, mut count) = (0.0, 0u64);
    for luminance in luminances(image).filter(|luminance| *luminance > 0.0) {
        sum += luminance.ln();
        count += 1;
    }
    let mean = if count == 0 { GREY } else { (sum / count as f64).exp() };
    // A tenth of a stop is what a flag repeats.
    ((10.0 * (GREY / mean).log2().clamp(-MOST_STOPS, MOST_STOPS)).round() / 10.0) as f32
}

fn luminances(image: &Image) -> impl Iterator<Item = f64> + '_ {
    let luminance =
        |&[r, g, b]: &[f32; 3]| 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
    image.pixels.iter().map(luminance).filter(|luminance| luminance.is_finite())
}

/// Luminance on a display below which it is black to the eye: byte 13 of 255.
const BLACK: f64 = 0.004;

/// Part of the pixels that decides whether a picture is black or burnt out.
const NEARLY_ALL: f64 = 0.95;

impl ViewTransform {
    /// The picture in linear sRGB of the display; itself if the view changes nothing.
    pub fn shown<'i>(&self, image: &'i Image) -> Cow<'i, Image> {
        if *self == Self::default() {
            return Cow::Borrowed(image);
        }
        let pixels = image.pixels.iter().map(|&pixel| self.pixel(pixel)).collect();
        Cow::Owned(Image { pixels, ..*image })
    }

    /// Linear sRGB on the display of a radiance.
    pub fn pixel(&self, radiance: [f32; 3]) -> [f32; 3] {
        let exposed = radiance.map(|channel| channel * self.stops.exp2());
        match self.curve {
            Curve::Clamp => exposed,
            _ if exposed.iter().any(|channel| !channel.is_finite()) => exposed,
            Curve::Neutral => neutral(exposed),
            Curve::Agx => agx(exposed),
        }
    }

    /// Word for a picture that is lit but shows nothing: `black` or `burnt out`.
    pub fn fault(&self, image: &Image) -> Option<&'static str> {
        let factor = f64::from(self.stops).exp2();
        let [mut all, mut black, mut burnt, mut lit] = [0u64; 4];
        for luminance in luminances(image) {
            all += 1;
            lit += u64::from(luminance > 0.0);
            black += u64::from(luminance * factor < BLACK);
            burnt += u64::from(luminance * factor > 1.0);
        }
        let is_nearly_all = |count: u64| count as f64 >= NEARLY_ALL * all as f64 && lit > 0;
        match (is_nearly_all(black), is_nearly_all(burnt)) {
            (true, _) => Some("black"),
            (_, true) => Some("burnt out"),
            _ => None,
        }
    }
}

/// Khronos PBR Neutral tone mapper.
fn neutral(color: [f32; 3]) -> [f32; 3] {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let least = color.into_iter().fold(f32::INFINITY, f32::min);
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let color = color.map(|channel| channel - offset);
    let peak = color.into_iter().fold(f32::NEG_INFINITY, f32::max);
    if peak < START {
        return color;
    }
    let rest = 1.0 - START;
    let new_peak = 1.0 - rest * rest / (peak + rest - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|channel| channel * new_peak / peak * (1.0 - white) + new_peak * white)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::save::to_srgb;

    fn view(curve: Curve) -> ViewTransform {
        ViewTransform { stops: 0.0, curve }
    }

    fn bytes(color: [f32; 3]) -> [f32; 3] {
        color.map(|channel| 255.0 * to_srgb(channel))
    }

    #[test]
    fn default_view_changes_no_bit() {
        let image = Image { width: 1, height: 1, pixels: vec![[0.1, 7.0, -3.0]] };
        assert!(matches!(ViewTransform::default().shown(&image), Cow::Borrowed(_)));
        assert_eq!(view(Curve::Clamp).pixel([0.1, 7.0, -3.0]), [0.1, 7.0, -3.0]);
        let brighter = ViewTransform { stops: 3.0, curve: Curve::Clamp };
        assert_eq!(brighter.pixel([0.1, 1.0, 0.0]), [0.8, 8.0, 0.0]);
    }

    #[test]
    fn neutral_has_the_values_of_its_specification() {
        let near = |color: [f32; 3], expected: [f32; 3]| {
            let found = view(Curve::Neutral).pixel(color);
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{color:?}: {found:?}");
        };
        // Base colours as they are lit by white light with a Fresnel reflection of 0.04.
        near([0.54; 3], [0.5; 3]);
        near([0.74, 0.14, 0.04], [0.71, 0.11, 0.01]);
        near([0.04; 3], [0.01; 3]);
        near([0.0; 3], [0.0; 3]);
        // By the GLSL of the specification, evaluated in f64.
        near([2.0, 1.0, 0.5], [0.96, 0.534091, 0.321136]);
        near([10.0, 0.1, 0.1], [0.993898, 0.572599, 0.572599]);
        near([0.9, 0.9, 0.9], [0.830588, 0.830588, 0.830588]);
        near([100.0, 50.0, 200.0], [0.983502, 0.975397, 0.999711]);
    }

    #[test]
    fn agx_is_blenders() {
        // Linear sRGB, and bytes by OpenColorIO 2 with the configuration of Blender 4.5.
        let known: [([f32; 3], [f32; 3]); 40] = [
            ([0.18, 0.18, 0.18], [117.64, 117.63, 117.63]),
            ([1.0, 1.0, 1.0], [196.6, 196.59, 196.59]),
            ([0.02, 0.02, 0.02], [31.88, 31.88, 31.88]),
            ([5.0, 5.0, 5.0], [237.3, 237.3, 237.3]),
            ([1.0, 0.0, 0.0], [218.79, 57.16, 32.96]),
            ([0.0, 1.0, 0.0], [110.27, 197.02, 81.2]),
            ([0.0, 0.0, 1.0], [20.13, 86.08, 209.47]),
            ([1.0, 1.0, 0.0], [199.43, 192.93, 108.07]),
            ([2.92281, 1.86424, 1.03391], [227.91, 214.01, 201.12]),
            ([0.00452, 0.00481, 0.00053], [7.9, 7.56, 0.02]),
            ([0.01132, 0.00739, 0.00266], [20.13, 13.21, 3.53]),
            ([0.20974, 0.19327, 0.18176], [125.78, 121.37, 118.15]),
            ([0.07674, 0.10533, 0.00946], [76.01, 84.38, 5.42]),
            ([0.14664, 0.47518, 0.03469], [115.42, 164.51, 61.11]),
            ([1.206, 0.31508, 1.24115], [203.44, 166.05, 205.71]),
            ([0.11181, 4.27209, 0.00724], [188.36, 235.53, 172.26]),
            ([0.1584, 0.07373, 0.11787], [108.58, 75.96, 94.49]),
            ([1.15543, 0.54417, 2.5504], [198.61, 187.76, 227.14]),
            ([0.1908, 0.05625, 0.07637], [118.82, 64.84, 74.16]),
            ([1.76409, 1.76172, 0.82172], [214.33, 212.29, 193.29]),
            ([0.00815, 0.00075, 0.00737], [14.13, 1.42, 13.62]),
            ([0.12279, 0.05157, 0.12091], [94.61, 64.05, 95.67]),
            ([0.13028, 0.40224, 0.36587], [113.94, 159.36, 155.29]),
            ([0.66799, 0.31956, 0.92307], [179.7, 159.13, 195.85]),
            ([0.01224, 0.01123, 0.00666], [21.9, 19.83, 12.44]),
            ([0.66807, 1.34443, 2.74746], [190.67, 207.45, 227.4]),
            ([0.10137, 0.08705, 0.13374], [86.45, 82.64, 101.08]),
            ([10.86684, 12.14573, 2.29545], [250.18, 250.16, 231.16]),
            ([1.51918, 0.71911, 0.99158], [210.85, 187.76, 196.18]),
            ([0.28982, 0.09593, 0.12158], [144.44, 88.07, 96.39]),
            ([0.00331, 0.00497, 0.00736], [5.07, 9.19, 13.73]),
            ([2.92685, 8.84144, 1.67801], [230.63, 246.24, 221.83]),
            ([0.65383, 1.68426, 0.30548], [185.48, 211.42, 164.3]),
            ([4.49251, 0.75773, 2.85719], [240.15, 203.49, 225.97]),
            ([0.0275, 0.03094, 0.00594], [39.77, 40.55, 9.24]),
            ([1.58546, 2.54361, 0.32573], [210.86, 221.64, 177.96]),
            ([0.00156, 0.00273, 0.0074], [1.34, 4.91, 13.67]),
            ([3.31641, 3.13875, 4.60358], [229.09, 228.93, 236.0]),
            ([1.83833, 4.32556, 2.17455], [219.6, 233.83, 220.6]),
            ([0.53412, 0.36312, 0.50031], [171.91, 157.41, 169.62]),
        ];
        let mut sum = 0.0;
        for (color, expected) in known {
            let found = bytes(view(Curve::Agx).pixel(color));
            for (a, b) in found.into_iter().zip(expected) {
                assert!((a - b).abs() < WORST, "{color:?}: {found:?}, not {expected:?}");
                sum += (a - b).abs() / (3.0 * known.len() as f32);
            }
        }
        assert!(sum < 0.05, "{sum}");
    }

    /// Largest difference, in 1/255: half a step of the known values and of entries outside of the gamut.
    const WORST: f32 = 1.0;

    #[test]
    fn curves_are_finite_and_keep_grey() {
        for curve in [Curve::Neutral, Curve::Agx] {
            for exponent in -40..40 {
                let grey = view(curve).pixel([(exponent as f32).exp2(); 3]);
                assert!(grey.iter().all(|c| (-1e-5..1.0001).contains(c)), "{curve:?} {exponent}: {grey:?}");
                assert!((grey[0] - grey[1]).abs() < 1e-4 && (grey[1] - grey[2]).abs() < 1e-4, "{grey:?}");
                let mut color = [0.0, 1.0, 3.0].map(|x| x * (exponent as f32).exp2());
                for _ in 0..3 {
                    color.rotate_left(1);
                    assert!(view(curve).pixel(color).iter().all(|c| c.is_finite()), "{color:?}");
                }
            }
        }
        let odd = view(Curve::Agx).pixel([f32::NAN, 1.0, 0.0]);
        assert!(odd[0].is_nan() && odd[1] == 1.0);
    }

    #[test]
    fn exposure_shows_what_is_too_dark_or_too_bright() {
        let image = |value: f32| Image { width: 2, height: 1, pixels: vec![[value; 3]; 2] };
        for (value, fault, stops) in
            [(0.18, None, 0.0), (1e-4, Some("black"), 10.8), (100.0, Some("burnt out"), -9.1)]
        {
            let image = image(value);
            assert_eq!(ViewTransform::default().fault(&image), fault);
            assert_eq!(automatic_stops(&image), stops);
            let shown = ViewTransform { stops, curve: Curve::Clamp };
            assert_eq!(shown.fault(&image), None);
        }
        assert_eq!((automatic_stops(&image(0.0)), ViewTransform::default().fault(&image(0.0))), (0.0, None));
        assert_eq!(automatic_stops(&image(f32::NAN)), 0.0);
    }
}
