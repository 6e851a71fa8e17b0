//! Conversion of linear colours to those of sRGB by the chromaticities of their primaries and white (SMPTE RP
//! 177). The white is adapted by Bradford's transform (ICC.1, annex E).

use glam::{DMat3, DVec3, Vec3};

/// x and y of red, green, blue and white.
type Chromaticities = [f64; 8];

const SRGB: Chromaticities = [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290];
/// The default of Radiance, which counts as sRGB.
const RADIANCE: Chromaticities = [0.64, 0.33, 0.29, 0.60, 0.15, 0.06, 0.3333, 0.3333];
/// Error of chromaticities: files have two to four digits.
const TOLERANCE: f64 = 0.006;
/// Largest magnitude of a chromaticity; primaries of cameras may be imaginary.
const LARGEST: f64 = 4.0;
/// Smallest y of a white.
const DARKEST_WHITE: f64 = 0.01;

/// CIE XYZ to the responses of Bradford's cones.
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

/// Meaning of the chromaticities of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Primaries {
    /// Those of sRGB, or zeros, which some writers leave there.
    Srgb,
    /// The matrix that converts colours to sRGB.
    Other(DMat3),
    /// No primaries span a gamut around a white.
    Invalid,
}

impl Primaries {
    /// Primaries of `given`: x and y of red, green, blue and white.
    pub(super) fn of(given: &[f64]) -> Self {
        if given.iter().all(|x| *x == 0.0) {
            return Self::Srgb;
        }
        let Ok(given) = Chromaticities::try_from(given) else { return Self::Invalid };
        let is_near =
            |known: &Chromaticities| known.iter().zip(&given).all(|(a, b)| (a - b).abs() <= TOLERANCE);
        if is_near(&SRGB) || is_near(&RADIANCE) {
            return Self::Srgb;
        }
        let (Some(from), Some(srgb)) = (to_xyz(&given), to_xyz(&SRGB)) else { return Self::Invalid };
        let [white, d65] = [from, srgb].map(|to_xyz| BRADFORD * to_xyz * DVec3::ONE);
        let adapted = BRADFORD.inverse() * DMat3::from_diagonal(d65 / white) * BRADFORD;
        let matrix = srgb.inverse() * adapted * from;
        if matrix.is_finite() { Self::Other(matrix) } else { Self::Invalid }
    }
}

/// CIE XYZ to linear sRGB, whose white is D65.
pub(super) fn xyz_to_srgb() -> DMat3 {
    to_xyz(&SRGB).map_or(DMat3::IDENTITY, |matrix| matrix.inverse())
}

/// RGB to CIE XYZ; white has Y = 1. `None` if the primaries do not span a gamut around the white.
fn to_xyz(given: &Chromaticities) -> Option<DMat3> {
    let [red, green, blue, white] =
        [0, 2, 4, 6].map(|i| DVec3::new(given[i], given[i + 1], 1.0 - given[i] - given[i + 1]));
    let is_usual = given.iter().all(|x| x.abs() <= LARGEST) && white.y >= DARKEST_WHITE;
    let primaries = DMat3::from_cols(red, green, blue);
    let weights = primaries.inverse() * (white / white.y);
    let is_around = weights.is_finite() && weights.cmpgt(DVec3::ZERO).all();
    (is_usual && is_around).then(|| primaries * DMat3::from_diagonal(weights))
}

/// The product of `matrix` and a colour; colours that are not finite stay as they are.
pub(super) fn converted(matrix: &DMat3, rgb: [f32; 3]) -> [f32; 3] {
    let colour = Vec3::from(rgb);
    if colour.is_finite() { (*matrix * colour.as_dvec3()).as_vec3().into() } else { rgb }
}

#[cfg(test)]
mod tests {
    use super::*;

    const D65: [f64; 2] = [0.3127, 0.3290];
    const ACES: [f64; 2] = [0.32168, 0.33767];

    fn of(rgb: [f64; 6], white: [f64; 2]) -> DMat3 {
        match Primaries::of(&[&rgb[..], &white].concat()) {
            Primaries::Other(matrix) => matrix,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn published_matrices() {
        // Rows of red, green, blue: colour-science.org, and ITU-R BT.2087 for BT.2020.
        let known = [
            (
                [0.713, 0.293, 0.165, 0.83, 0.128, 0.044],
                ACES,
                [1.70505, -0.62179, -0.08326, -0.13026, 1.14080, -0.01055, -0.02400, -0.12897, 1.15297],
            ),
            (
                [0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077],
                ACES,
                [2.52169, -1.13413, -0.38756, -0.27648, 1.37272, -0.09624, -0.01538, -0.15298, 1.16835],
            ),
            (
                [0.708, 0.292, 0.17, 0.797, 0.131, 0.046],
                D65,
                [1.6605, -0.5876, -0.0728, -0.1246, 1.1329, -0.0083, -0.0182, -0.1006, 1.1187],
            ),
            (
                [0.68, 0.32, 0.265, 0.69, 0.15, 0.06],
                D65,
                [1.22494, -0.22494, 0.0, -0.04206, 1.04206, 0.0, -0.01964, -0.07864, 1.09827],
            ),
        ];
        for (rgb, white, rows) in known {
            let matrix = of(rgb, white);
            let found = matrix.transpose().to_cols_array();
            assert!(found.iter().zip(rows).all(|(a, b)| (a - b).abs() < 1e-4), "{rgb:?}: {found:?}");
            // White stays white.
            assert!((matrix * DVec3::ONE).abs_diff_eq(DVec3::ONE, 1e-12));
        }
    }

    #[test]
    fn xyz_as_primaries_is_adapted_to_d65() {
        let matrix = of([1.0, 0.0, 0.0, 1.0, 0.0, 0.0], [1.0 / 3.0; 2]);
        assert!((matrix * DVec3::ONE).abs_diff_eq(DVec3::ONE, 1e-12));
        let white = xyz_to_srgb() * DVec3::new(0.3127 / 0.329, 1.0, 0.3583 / 0.329);
        assert!(white.abs_diff_eq(DVec3::ONE, 1e-12), "{white}");
    }

    #[test]
    fn srgb_and_zeros_change_nothing_and_others_are_invalid() {
        for same in [SRGB, RADIANCE, [0.0; 8]] {
            assert_eq!(Primaries::of(&same), Primaries::Srgb);
        }
        let odd: [&[f64]; 6] = [
            &[0.64, 0.33],
            &[0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.0, 0.0],
            &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3127, 0.329],
            &[0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.3127, 0.329],
            &[0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.9, 0.05],
            &[f64::NAN, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329],
        ];
        for given in odd {
            assert_eq!(Primaries::of(given), Primaries::Invalid, "{given:?}");
        }
    }

    #[test]
    fn infinite_colours_stay_infinite() {
        let matrix = of([0.713, 0.293, 0.165, 0.83, 0.128, 0.044], ACES);
        assert_eq!(converted(&matrix, [f32::INFINITY; 3]), [f32::INFINITY; 3]);
        let [r, g, b] = converted(&matrix, [0.5, 0.25, 0.125]);
        assert!((r - 0.68667).abs() < 1e-4 && (g - 0.21875).abs() < 1e-4 && (b - 0.09988).abs() < 1e-4);
    }
}
