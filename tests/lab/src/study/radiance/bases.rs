//! Errors of the light that metal reflects, for bases of incident radiance and numbers of coefficients.

use super::Row;
use super::rooms::Room;
use glam::Vec3;
use halflight::pages::Pages;
use halflight_core::Rgb;
use halflight_core::bsdf::{All, Bsdf, Conductor};
use halflight_core::cache::radiance::{sh, zernike};
use halflight_core::memory::{Arena, OutOfMemory};
use halflight_core::sampling::warp::cosine_hemisphere;
use halflight_test_support::Random;
use serde_json::{Value, json};

/// GGX alphas of the lobes.
const ALPHAS: [f32; 5] = [0.1, 0.2, 0.3, 0.5, 1.0];

/// Angles of the viewer in degrees, common ones and grazing ones.
const ANGLES: [&[f32]; 2] = [&[5.0, 20.0, 35.0, 50.0, 62.0], &[72.0, 80.0]];
/// Azimuths of the viewer.
const AZIMUTHS: usize = 4;
/// Receivers in each room.
const RECEIVERS: usize = 16;
/// Strata along a side of the hemisphere, fine enough to be exact.
const STRATA: usize = 96;

/// Errors of a basis.
#[derive(Debug)]
pub(super) struct BasisError {
    /// `zernike` or `sh`.
    basis: &'static str,
    /// Highest degree or order.
    degree: usize,
    /// Number of coefficients.
    count: usize,
    /// Root mean square error relative to that of the light, for each of [`ALPHAS`]: viewers at 5° to 62°,
    /// and at 72° and 80°.
    errors: [[f64; 2]; ALPHAS.len()],
}

impl Row for BasisError {
    fn head() -> String {
        let alphas = ALPHAS.map(|alpha| format!("{:>14}", format!("alpha {alpha:.1}"))).concat();
        format!(
            "errors of light from metal, relative to its size, for viewers at 5 to 62 and at 72 to 80 degrees\n\
             basis    degree coefficients{alphas}"
        )
    }

    fn line(&self) -> String {
        let errors = self.errors.map(|[common, grazing]| format!("{common:>7.4}{grazing:>7.4}")).concat();
        format!("{:<8} {:>6} {:>12}{errors}", self.basis, self.degree, self.count)
    }

    fn object(&self) -> Value {
        let error = |(alpha, [common, grazing]): (f32, [f64; 2])| json!({ "alpha": alpha, "common": common, "grazing": grazing });
        let errors: Vec<_> = ALPHAS.into_iter().zip(self.errors).map(error).collect();
        json!({ "basis": self.basis, "degree": self.degree, "coefficients": self.count, "errors": errors })
    }
}

/// Lobe of one alpha for one viewer.
struct Lobe {
    alpha: usize,
    is_grazing: bool,
    /// f at each stratum.
    values: Vec<f32>,
    zernike: [f64; zernike::COUNT_MAX],
    sh: [f64; sh::COUNT_MAX],
}

/// Directions in the middle of the strata, with the functions of both bases.
struct Grid {
    directions: Vec<Vec3>,
    zernike: Vec<[f32; zernike::COUNT_MAX]>,
    sh: Vec<[f32; sh::COUNT_MAX]>,
}

/// cos θ dω of a stratum.
const SHARE: f64 = core::f64::consts::PI / (STRATA * STRATA) as f64;

impl Grid {
    fn new() -> Self {
        let centre = |k: usize| (k as f32 + 0.5) / STRATA as f32;
        let strata = 0..STRATA * STRATA;
        let directions: Vec<_> =
            strata.map(|c| cosine_hemisphere([centre(c % STRATA), centre(c / STRATA)])).collect();
        Self {
            zernike: directions.iter().map(|w| zernike::values(zernike::DEGREE_MAX, [w.x, w.y])).collect(),
            sh: directions.iter().map(|w| sh::values(sh::ORDER_MAX, w.to_array())).collect(),
            directions,
        }
    }

    fn lobe(&self, alpha: usize, angle: f32, azimuth: f32, is_grazing: bool) -> Lobe {
        let (sin, cos) = angle.to_radians().sin_cos();
        let wo = Vec3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos);
        let bsdf = Bsdf::Conductor(Conductor { f0: Rgb::ONE, alpha: ALPHAS[alpha] });
        let f = |wi: &Vec3| bsdf.evaluate::<All>(wo, *wi).0.x / wi.z;
        let values: Vec<f32> = self.directions.iter().map(f).collect();
        let weights = values.iter().map(|&f| SHARE * f64::from(f));
        let (zernike, sh) = (weighted(&self.zernike, weights.clone()), weighted(&self.sh, weights));
        Lobe { alpha, is_grazing, values, zernike, sh }
    }
}

/// Σ weight × row.
fn weighted<const N: usize>(rows: &[[f32; N]], weights: impl Iterator<Item = f64>) -> [f64; N] {
    let mut sums = [0.0; N];
    for (row, weight) in rows.iter().zip(weights) {
        sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * f64::from(*value));
    }
    sums
}

/// Errors of all bases.
pub(super) fn measure(each: &mut dyn FnMut(&BasisError)) -> Result<(), OutOfMemory> {
    errors()?.iter().for_each(each);
    Ok(())
}

/// Errors of every basis over all rooms.
fn errors() -> Result<Vec<BasisError>, OutOfMemory> {
    let grid = Grid::new();
    let mut lobes = Vec::new();
    for alpha in 0..ALPHAS.len() {
        for (is_grazing, angles) in [false, true].into_iter().zip(ANGLES) {
            for (&angle, turn) in angles.iter().flat_map(|angle| (0..AZIMUTHS).map(move |turn| (angle, turn)))
            {
                let azimuth = 0.3 + turn as f32 * core::f32::consts::TAU / AZIMUTHS as f32;
                lobes.push(grid.lobe(alpha, angle, azimuth, is_grazing));
            }
        }
    }
    let mut lines = Pages::new(sh::ShTables::footprint(STRATA, sh::ORDER_MAX))?;
    let tables = sh::ShTables::build(STRATA, sh::ORDER_MAX, &mut Arena::over(&mut lines))?;
    let per_stratum = tables.integrals().len() / (STRATA * STRATA);

    let zernike = [2, 4, 6, 8].map(|d| ("zernike", d, zernike::count(d)));
    let sh = [3, 4, 6, 8].map(|l| ("sh", l, sh::count(l)));
    let mut found: Vec<_> = zernike.into_iter().chain(sh).map(|basis| (basis, Sums::default())).collect();
    for room in Room::all() {
        let mut random = Random(29);
        for _ in 0..RECEIVERS {
            let from = room.receiver(&mut random);
            let light = |w: &Vec3| room.radiance(from, w.as_dvec3()).0;
            let light: Vec<f64> = grid.directions.iter().map(light).collect();
            let by_zernike = weighted(&grid.zernike, light.iter().map(|light| SHARE * light));
            let mut by_sh = [0.0; sh::COUNT_MAX];
            for (row, light) in tables.integrals().chunks_exact(per_stratum).zip(&light) {
                let integrals = row.as_flattened();
                by_sh.iter_mut().zip(integrals).for_each(|(sum, y)| *sum += light * f64::from(*y));
            }
            let mut receiver: Vec<_> = found.iter().map(|_| Sums::default()).collect();
            for lobe in &lobes {
                let pairs = lobe.values.iter().zip(&light);
                let exact: f64 = SHARE * pairs.map(|(&f, light)| f64::from(f) * light).sum::<f64>();
                for (((basis, _, count), _), sums) in found.iter().zip(&mut receiver) {
                    let estimate = match *basis {
                        "sh" => dot(&lobe.sh, &by_sh, *count),
                        _ => dot(&lobe.zernike, &by_zernike, *count),
                    };
                    let cell = &mut sums.0[lobe.alpha][usize::from(lobe.is_grazing)];
                    *cell = [cell[0] + (estimate - exact).powi(2), cell[1] + exact * exact];
                }
            }
            // Receivers in the dark count as much as those in the light.
            for ((_, total), receiver) in found.iter_mut().zip(receiver) {
                for (total, [error, size]) in
                    total.0.as_flattened_mut().iter_mut().zip(receiver.0.as_flattened())
                {
                    *total = [total[0] + error / size, total[1] + 1.0];
                }
            }
        }
    }
    let row = |((basis, degree, count), sums): ((&'static str, usize, usize), Sums)| BasisError {
        basis,
        degree,
        count,
        errors: sums.0.map(|alpha| alpha.map(|[error, count]| (error / count).sqrt())),
    };
    Ok(found.into_iter().map(row).collect())
}

/// Sums of squared errors and of squares, by alpha and grazing.
#[derive(Clone, Copy, Default)]
struct Sums([[[f64; 2]; 2]; ALPHAS.len()]);

/// Sum of the first products.
fn dot(a: &[f64], b: &[f64], count: usize) -> f64 {
    a.iter().zip(b).take(count).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 28 Zernike polynomials have less error than 49 spherical harmonics, and 45 less than 81, for every
    /// lobe from alpha 0.2 on. Errors fall with the degree.
    #[test]
    fn zernike_polynomials_need_fewer_coefficients_than_spherical_harmonics() {
        let found = errors().unwrap();
        let row =
            |basis, degree| found.iter().find(|row| (row.basis, row.degree) == (basis, degree)).unwrap();
        let is_smaller = |a: &BasisError, b: &BasisError| {
            let pairs = a.errors.as_flattened().iter().zip(b.errors.as_flattened());
            pairs.skip(2).all(|(a, b)| a < b)
        };
        for (degree, counts) in [(6, (28, 49)), (8, (45, 81))] {
            let (zernike, sh) = (row("zernike", degree), row("sh", degree));
            assert_eq!((zernike.count, sh.count), counts);
            assert!(is_smaller(zernike, sh), "{zernike:?} {sh:?}");
            assert!(is_smaller(zernike, row("zernike", degree - 2)), "{zernike:?}");
        }
    }
}
