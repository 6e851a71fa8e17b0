//! Spherical harmonics of radiance from irradiances by a bundle of normals (Ramamoorthi and Hanrahan 2001).

use super::PointIrradiance;
use crate::Rgb;
use core::f32::consts::{FRAC_PI_4, PI};
use glam::Vec3;

/// Light around a point: spherical harmonics of radiance to degree 2, in the order 1, y, z, x, xy, yz,
/// 3z² - 1, xz, x² - y², as `SphericalHarmonics3` of three.js has them.
///
/// ```
/// use halflight_core::glam::Vec3;
/// use halflight_core::renderer::{LightProbe, PointIrradiance};
/// use halflight_core::Rgb;
///
/// // Irradiances of a white sky by all normals, in place of those of an `IrradianceRenderer`.
/// let irradiance = Rgb::splat(core::f32::consts::PI);
/// let of_sky = PointIrradiance { irradiance, lower: 3.0, upper: 3.3, samples: 64 };
/// let probe = LightProbe::of(&LightProbe::normals().map(|_| of_sky));
/// assert!((probe.irradiance(Vec3::X) - irradiance).length() < 1e-4);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightProbe {
    /// Coefficients of radiance.
    pub coefficients: [Rgb; 9],
    /// Half-widths of the 95 % intervals of their luminances.
    pub half_widths: [f32; 9],
}

impl LightProbe {
    /// Number of the normals of a probe.
    pub const NORMALS: usize = 24;

    /// The unit normals at which a probe takes irradiances: a spherical 7-design.
    pub fn normals() -> [Vec3; Self::NORMALS] {
        design()
    }

    /// The probe of `values`, the irradiances by [`LightProbe::normals`].
    pub fn of(values: &[PointIrradiance]) -> Self {
        let solid_angle = 4.0 * PI / Self::NORMALS as f32;
        let mut probe = Self::default();
        for (value, normal) in values.iter().zip(design()) {
            for (i, harmonic) in harmonics(normal).into_iter().enumerate() {
                let weight = solid_angle * harmonic / COSINE[i];
                probe.coefficients[i] += weight * value.irradiance;
                let half_width = weight.abs() * (value.upper - value.value());
                probe.half_widths[i] = libm::hypotf(probe.half_widths[i], half_width);
            }
        }
        probe
    }

    /// Irradiance of a unit `normal`.
    pub fn irradiance(&self, normal: Vec3) -> Rgb {
        let basis = harmonics(normal).into_iter().zip(COSINE);
        basis.zip(self.coefficients).map(|((harmonic, cosine), colour)| harmonic * cosine * colour).sum()
    }
}

/// Coordinates of a point whose images under the rotations of a cube are a spherical 7-design (McLaren 1963):
/// sums over them integrate polynomials of degree 7. Their squares are the roots of z³ - z² + z/5 - 1/105.
const DESIGN: [f32; 3] = [0.266_635_4, 0.422_518_65, 0.866_246_8];

fn design() -> [Vec3; LightProbe::NORMALS] {
    const PERMUTATIONS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    core::array::from_fn(|number| {
        let (permutation, signs) = (number / 4, number % 4);
        // Rotations have even permutations with an even number of signs, and odd ones with an odd number.
        let last = (signs ^ signs >> 1) & 1 ^ usize::from(permutation >= 3);
        let negative = [signs & 1, signs >> 1, last];
        let axis = |i: usize| DESIGN[PERMUTATIONS[permutation][i]] * [1.0, -1.0][negative[i]];
        Vec3::new(axis(0), axis(1), axis(2)).normalize()
    })
}

/// Real spherical harmonics to degree 2, in the order 1, y, z, x, xy, yz, 3z² - 1, xz, x² - y².
fn harmonics(Vec3 { x, y, z }: Vec3) -> [f32; 9] {
    let quadratic = [x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y];
    let scales = [1.092_548_4, 1.092_548_4, 0.315_391_57, 1.092_548_4, 0.546_274_2];
    let linear = [y, z, x].map(|axis| 0.488_602_52 * axis);
    core::array::from_fn(|i| match i {
        0 => 0.282_094_8,
        1..4 => linear[i - 1],
        _ => scales[i - 4] * quadratic[i - 4],
    })
}

/// Factors of the harmonics of radiance that give those of irradiance.
const COSINE: [f32; 9] = {
    const LINEAR: f32 = 2.0 * PI / 3.0;
    [PI, LINEAR, LINEAR, LINEAR, FRAC_PI_4, FRAC_PI_4, FRAC_PI_4, FRAC_PI_4, FRAC_PI_4]
};

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of x^a y^b z^c over the sphere: 0 with an odd exponent.
    fn mean(exponents: [i32; 3]) -> f64 {
        let odd = |n: i32| (1..n).step_by(2).map(f64::from).product::<f64>();
        match exponents.iter().all(|exponent| exponent % 2 == 0) {
            true => exponents.map(odd).iter().product::<f64>() / odd(exponents.iter().sum::<i32>() + 2),
            false => 0.0,
        }
    }

    #[test]
    fn the_design_integrates_polynomials_of_degree_seven() {
        for (a, b, c) in (0..512).map(|i| (i % 8, i / 8 % 8, i / 64)).filter(|(a, b, c)| a + b + c <= 7) {
            let value = |n: Vec3| {
                let [x, y, z] = n.to_array().map(f64::from);
                x.powi(a) * y.powi(b) * z.powi(c)
            };
            let sum: f64 = design().into_iter().map(value).sum();
            assert!((sum / 24.0 - mean([a, b, c])).abs() < 1e-6, "{a} {b} {c}");
        }
    }

    /// Root mean square errors of irradiance below a distant lamp in `direction`, of irradiance 1: by the
    /// exact projection of its radiance, and by its irradiances at the normals of the design.
    fn errors(direction: Vec3) -> [f64; 2] {
        let irradiance = |normal: Vec3| normal.dot(direction).max(0.0);
        let mut by_design = [0.0; 9];
        for normal in design() {
            let values = harmonics(normal).map(|harmonic| 4.0 * PI / 24.0 * harmonic * irradiance(normal));
            by_design
                .iter_mut()
                .zip(values)
                .zip(COSINE)
                .for_each(|((sum, value), cosine)| *sum += value / cosine);
        }
        [harmonics(direction), by_design].map(|coefficients| {
            let square = |i: u32| {
                let (z, turns) = (1.0 - (2.0 * i as f32 + 1.0) / 1000.0, i as f32 * 0.618_034);
                let (sin, cos) = (2.0 * PI * turns).sin_cos();
                let normal = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                let sum: f32 = (0..9).map(|k| coefficients[k] * COSINE[k] * harmonics(normal)[k]).sum();
                f64::from(sum - irradiance(normal)).powi(2)
            };
            ((0..1000).map(square).sum::<f64>() / 1000.0).sqrt()
        })
    }

    #[test]
    fn a_distant_lamp_has_the_error_of_degree_two() {
        // Degrees 0, 1 and 2 of the cosine have 1/16, 1/12 and 5/256 of its mean square, 1/6.
        let truncation = (1.0f64 / 6.0 - 1.0 / 16.0 - 1.0 / 12.0 - 5.0 / 256.0).sqrt();
        for i in 0..20 {
            let (z, turns) = (0.95 - 0.1 * i as f32, 2.4 * i as f32);
            let radius = (1.0 - z * z).sqrt();
            let [exact, by_design] = errors(Vec3::new(radius * turns.cos(), radius * turns.sin(), z));
            assert!((exact - truncation).abs() < 1e-3, "{exact} {truncation}");
            assert!((0.035..0.041).contains(&by_design), "{by_design}");
        }
    }

    #[test]
    fn harmonics_are_orthonormal() {
        for (i, j) in (0..81).map(|pair| (pair / 9, pair % 9)) {
            let sum: f32 = design().iter().map(|n| harmonics(*n)[i] * harmonics(*n)[j]).sum();
            assert!((4.0 * PI / 24.0 * sum - f32::from(u8::from(i == j))).abs() < 1e-5, "{i} {j}");
        }
    }
}
