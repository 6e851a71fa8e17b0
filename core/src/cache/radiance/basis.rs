//! Bases of incident radiance: Zernike polynomials, and spherical harmonics as in Křivánek et al. (2005).
//!
//! Both have functions of some degree d and order m, of which those with negative m have sin |m|φ and the
//! others cos mφ. The coefficients of a lobe are ∫ f cos θ b_k dω in both; those of incident radiance are
//! ∫ L cos θ Z_k dω and ∫ L Y_k dω.

use super::{sh, zernike};
use core::f32::consts::PI;
use glam::Vec3;

/// Largest degree of any basis.
pub(super) const DEGREE_MAX: usize = sh::ORDER_MAX;

/// Number of functions of the largest representation.
pub(super) const COUNT_MAX: usize = sh::COUNT_MAX;

/// Largest number of functions with m >= 0.
pub(super) const ROWS_MAX: usize = (DEGREE_MAX + 1) * (DEGREE_MAX + 2) / 2;

/// Basis of incident radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Basis {
    /// Zernike polynomials on the disk of directions, orthonormal with the weight cos θ.
    #[default]
    Zernike,
    /// Spherical harmonics with light below the horizon as zero.
    SphericalHarmonics,
}

impl Basis {
    /// All bases.
    pub const ALL: [Basis; 2] = [Basis::Zernike, Basis::SphericalHarmonics];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Basis::Zernike => "zernike",
            Basis::SphericalHarmonics => "sh",
        }
    }

    /// Basis of this name.
    pub fn named(name: &str) -> Option<Basis> {
        Basis::ALL.into_iter().find(|basis| basis.name() == name)
    }

    /// Largest degree.
    pub const fn degree_max(self) -> usize {
        match self {
            Basis::Zernike => zernike::DEGREE_MAX,
            Basis::SphericalHarmonics => sh::ORDER_MAX,
        }
    }

    /// Usual largest degree of records.
    pub const fn usual_degree(self) -> usize {
        match self {
            Basis::Zernike => 6,
            Basis::SphericalHarmonics => 9,
        }
    }

    /// Number of functions up to `degree`.
    pub const fn count(self, degree: usize) -> usize {
        match self {
            Basis::Zernike => zernike::count(degree),
            Basis::SphericalHarmonics => sh::count(degree),
        }
    }

    /// Number of the function of `degree` and order m, one of those of the degree.
    pub const fn index(self, degree: usize, m: isize) -> usize {
        match self {
            Basis::Zernike => zernike::index(degree, m),
            Basis::SphericalHarmonics => sh::index(degree, m),
        }
    }

    /// Step between the orders m of a degree.
    pub(super) const fn step(self) -> usize {
        match self {
            Basis::Zernike => 2,
            Basis::SphericalHarmonics => 1,
        }
    }

    /// Number of functions with m >= 0.
    pub(super) const fn row_count(self) -> usize {
        match self {
            Basis::Zernike => 25,
            Basis::SphericalHarmonics => ROWS_MAX,
        }
    }

    /// Degree and order of the functions with m >= 0.
    pub(super) fn rows(self) -> impl Iterator<Item = (usize, usize)> {
        let step = self.step();
        (0..=self.degree_max()).flat_map(move |d| (d % step..=d).step_by(step).map(move |m| (d, m)))
    }

    /// Values of all functions in the unit direction `w`, w.z >= 0.
    pub(super) fn values(self, w: Vec3) -> [f32; COUNT_MAX] {
        match self {
            Basis::Zernike => {
                let mut values = [0.0; COUNT_MAX];
                let functions = zernike::values(zernike::DEGREE_MAX, [w.x, w.y]);
                values.iter_mut().zip(functions).for_each(|(value, function)| *value = function);
                values
            }
            Basis::SphericalHarmonics => sh::values(sh::ORDER_MAX, w.to_array()),
        }
    }

    /// 1 over the function of degree 0.
    pub(super) fn inverse_of_constant(self) -> f32 {
        match self {
            Basis::Zernike => libm::sqrtf(PI),
            Basis::SphericalHarmonics => libm::sqrtf(4.0 * PI),
        }
    }

    /// Square of the norm of radiance 1 over the hemisphere, in the inner product of the basis.
    pub(super) fn square_of_one(self) -> f32 {
        match self {
            Basis::Zernike => PI,
            Basis::SphericalHarmonics => 2.0 * PI,
        }
    }

    /// Factor of f² cos dω in the square of a lobe's norm.
    pub(super) fn square_factor(self, cos: f32) -> f32 {
        match self {
            Basis::Zernike => 1.0,
            Basis::SphericalHarmonics => cos,
        }
    }
}

/// Basis and degree of the coefficients of records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Representation {
    /// The basis.
    pub basis: Basis,
    /// Highest degree, at most [`Basis::degree_max`].
    pub degree: usize,
}

impl Representation {
    /// Number of coefficients.
    pub const fn count(self) -> usize {
        self.basis.count(if self.degree > self.basis.degree_max() {
            self.basis.degree_max()
        } else {
            self.degree
        })
    }

    /// Representation of the gradients: two degrees below the values with Zernike polynomials, since higher
    /// ones add noise and no precision; all with spherical harmonics, as in the paper.
    pub(super) const fn of_gradients(self) -> Self {
        let degree = match (self.basis, self.degree) {
            (Basis::Zernike, 3..=4) => 2,
            (Basis::Zernike, 5..) => self.degree - 2,
            (_, degree) => degree,
        };
        Self { degree, ..self }
    }

    /// Registers of sixteen for the coefficients of a channel, and for a component of their gradients.
    pub(super) const fn groups(self) -> [usize; 2] {
        [self.count().div_ceil(16), self.of_gradients().count().div_ceil(16)]
    }

    /// Registers of a record: values of three channels, then gradients along x and y of each.
    pub(crate) const fn registers(self) -> usize {
        let [values, slopes] = self.groups();
        3 * values + 6 * slopes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn representations_have_their_sizes() {
        let of = |basis, degree| {
            let representation = Representation { basis, degree };
            (representation.count(), representation.groups(), representation.registers() * 32)
        };
        assert_eq!(of(Basis::Zernike, 6), (28, [2, 1], 384));
        assert_eq!(of(Basis::Zernike, 8), (45, [3, 2], 672));
        assert_eq!(of(Basis::SphericalHarmonics, 6), (49, [4, 4], 1152));
        assert_eq!(of(Basis::SphericalHarmonics, 9), (100, [7, 7], 2016));
        assert_eq!(of(Basis::Zernike, usize::MAX).0, 45);
        for basis in Basis::ALL {
            assert_eq!(Basis::named(basis.name()), Some(basis));
            assert_eq!(basis.rows().count(), basis.row_count());
            let rows = basis.rows().map(|(d, m)| basis.index(d, m as isize));
            let sines = basis.rows().filter(|(_, m)| *m > 0).map(|(d, m)| basis.index(d, -(m as isize)));
            let mut numbers: std::vec::Vec<_> = rows.chain(sines).collect();
            numbers.sort_unstable();
            assert!(numbers.into_iter().eq(0..basis.count(basis.degree_max())));
        }
        assert_eq!(Basis::named("hsh"), None);
    }
}
