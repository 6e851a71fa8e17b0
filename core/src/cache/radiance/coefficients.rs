//! Coefficients of incident radiance: projection of a hemisphere of gather rays onto the basis.

use super::strata::{StrataTables, groups};
use super::zernike::{COUNT_MAX, count};
use crate::Level;
use crate::Rgb;
use crate::cache::hemisphere::Hemisphere;
use core::f32::consts::PI;
use halflight_simd::kernels::outer::Outer;

/// Registers of sixteen for all functions.
pub(super) const GROUPS_MAX: usize = COUNT_MAX.div_ceil(16);

/// Coefficients λ_k = ∫ L Z_k cos θ dω of each channel, W/m²; zero beyond the degree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Degree of the representation.
    pub degree: usize,
    /// Coefficients of red, green and blue, numbered as in [`super::zernike`].
    pub values: [[f32; COUNT_MAX]; 3],
}

impl Coefficients {
    /// Projects the radiances of a hemisphere. `None` if it has another number of strata than the tables.
    /// The coefficient of degree 0 is E/√π of [`Hemisphere::irradiance`].
    ///
    /// ```
    /// use halflight_core::{Level, cache::irradiance::Hemisphere, memory::{Arena, Line}};
    /// use halflight_core::cache::radiance::{Coefficients, StrataTables};
    /// let mut lines = vec![Line([0; 64]); StrataTables::footprint(8, 2).bytes() / 64];
    /// let tables = StrataTables::build(8, 2, &mut Arena::over(&mut lines))?;
    /// let (radiance, inverse, directions) = ([[1.0; 3]; 64], [0.0; 64], [[0.0, 0.0, 1.0]; 64]);
    /// let hemisphere = Hemisphere::new(8, &radiance, &inverse, &directions).unwrap();
    /// let found = Coefficients::project(Level::detect(), &tables, &hemisphere).unwrap();
    /// // Radiance 1 everywhere has the coefficients √π, 0, 0, …
    /// assert!((found.values[1][0] - std::f32::consts::PI.sqrt()).abs() < 1e-6);
    /// assert!(found.values[1][1..].iter().all(|value| value.abs() < 2e-3));
    /// # Ok::<(), halflight_core::memory::OutOfMemory>(())
    /// ```
    pub fn project(level: Level, tables: &StrataTables, hemisphere: &Hemisphere) -> Option<Self> {
        if hemisphere.n() != tables.n() {
            return None;
        }
        let mut sums = [[[0.0; 16]; 3]; GROUPS_MAX];
        let sums = sums.get_mut(..groups(tables.degree()))?;
        Outer { factors: hemisphere.radiance(), table: tables.means(), sums }.add(level);
        let share = PI / (tables.n() * tables.n()) as f32;
        let mut values = [[0.0; COUNT_MAX]; 3];
        let first = hemisphere.irradiance() / libm::sqrtf(PI);
        for (channel, values) in values.iter_mut().enumerate() {
            let sums = sums.iter().flat_map(|group| group[channel]).take(count(tables.degree()));
            for (value, sum) in values.iter_mut().zip(sums) {
                *value = share * sum;
            }
            values[0] = first.to_array()[channel];
        }
        Some(Self { degree: tables.degree(), values })
    }

    /// Irradiance, W/m².
    pub fn irradiance(&self) -> Rgb {
        Rgb::from_array(self.values.map(|values| values[0])) * libm::sqrtf(PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::radiance::zernike::{DEGREE_MAX, index};
    use crate::cache::skies::{Sky, with_strata};

    /// L = 1 + s·w: E = π + 2π/3 s_z, degree 1 = s √π/2, and with P_j of Legendre ∫ z Z_{2j,0} dx dy =
    /// √(π(2j + 1)) ∫ √((1 - t)/2) P_j dt/√2 = -2 √(π(2j + 1))/((2j - 1)(2j + 1)(2j + 3)).
    #[test]
    fn a_sky_with_a_slope_has_the_coefficients_of_the_integral() {
        /// Damping by means over strata, and error of z in the middle of a stratum at the horizon.
        const DAMPING: f32 = 0.02;
        const MIDPOINTS: f32 = 2e-3;
        const N: usize = 128;
        let s = [0.5f32, -0.25, 0.75];
        let sky = Sky::new(N, |w| 1.0 + s[0] * w[0] + s[1] * w[1] + s[2] * w[2]);
        with_strata(N, DEGREE_MAX, |tables| {
            let found = Coefficients::project(Level::detect(), tables, &sky.hemisphere()).unwrap();
            let root = libm::sqrtf(PI);
            let mut wanted = [0.0; COUNT_MAX];
            wanted[0] = root + 2.0 * root / 3.0 * s[2];
            wanted[index(1, 1)] = 0.5 * root * s[0];
            wanted[index(1, -1)] = 0.5 * root * s[1];
            for (d, integral) in [(2usize, 15.0), (4, 105.0), (6, 315.0), (8, 693.0)] {
                wanted[index(d, 0)] = -2.0 * root * libm::sqrtf((d + 1) as f32) * s[2] / integral;
            }
            for (k, (value, wanted)) in found.values[0].iter().zip(wanted).enumerate() {
                let tolerance = DAMPING * wanted.abs() + MIDPOINTS;
                assert!((value - wanted).abs() < tolerance, "{k}: {value} {wanted}");
            }
            assert!((found.irradiance().x - PI - 2.0 * PI / 3.0 * s[2]).abs() < 1e-3);
        });
    }

    #[test]
    fn degree_zero_is_the_irradiance_to_the_bit() {
        let sky = Sky::new(17, |w| 0.3 + w[0] * w[0] * w[2]);
        with_strata(17, 4, |tables| {
            let hemisphere = sky.hemisphere();
            for level in Level::detect().and_below() {
                let found = Coefficients::project(level, tables, &hemisphere).unwrap();
                assert_eq!(found.values[2][0], hemisphere.irradiance().z / libm::sqrtf(PI));
                assert_eq!(found.values[0][count(4)..], [0.0; COUNT_MAX - 15]);
            }
            let other = Sky::new(16, |_| 1.0);
            assert!(Coefficients::project(Level::BASELINE, tables, &other.hemisphere()).is_none());
        });
    }

    /// A light turned by φ about the normal multiplies λ_{d,m} + iλ_{d,-m} by e^{imφ}; a mirrored one changes
    /// the sign of the sines.
    #[test]
    fn coefficients_turn_and_mirror_with_the_light() {
        let light = |w: [f32; 3]| 1.0 + w[0] * w[1] * w[1] + 0.4 * w[0] * w[2] - 0.2 * w[1];
        let (sin, cos) = (0.6f32, 0.8f32);
        with_strata(64, 6, |tables| {
            let of = |sky: Sky| Coefficients::project(Level::detect(), tables, &sky.hemisphere()).unwrap();
            let here = of(Sky::new(64, light)).values[1];
            let turned = Sky::new(64, |[x, y, z]| light([cos * x + sin * y, cos * y - sin * x, z]));
            let turned = of(turned).values[1];
            let mirrored = of(Sky::new(64, |[x, y, z]| light([x, -y, z]))).values[1];
            for d in 0..=6usize {
                for m in (d % 2..=d).step_by(2) {
                    let (a, b) = (index(d, m as isize), index(d, -(m as isize)));
                    let (mut c, mut s) = (1.0, 0.0);
                    for _ in 0..m {
                        (c, s) = (c * cos - s * sin, s * cos + c * sin);
                    }
                    let (re, im) = if m == 0 { (here[a], 0.0) } else { (here[a], here[b]) };
                    assert!((turned[a] - (re * c - im * s)).abs() < 2e-3, "{d} {m}");
                    assert!(m == 0 || (turned[b] - (re * s + im * c)).abs() < 2e-3, "{d} {m}");
                    assert!((mirrored[a] - here[a]).abs() < 2e-3, "{d} {m}");
                    assert!(m == 0 || (mirrored[b] + here[b]).abs() < 2e-3, "{d} {m}");
                }
            }
        });
    }
}
