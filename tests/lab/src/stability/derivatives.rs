//! Kernels of the irradiance cache against f64: decompositions of 3 x 3 matrices, and derivatives of
//! irradiance along edges.

use super::Table;
use super::kernels::{ulp, worst};
use core::f64::consts::FRAC_PI_2;
use glam::{DMat3, DVec3};
use halflight_core::Level;
use halflight_core::sampling::Random;
use halflight_simd::kernels::edge::flux_of;
use halflight_simd::kernels::eigen::decompose3;

/// Stream of random numbers in [−1, 1).
struct Draws(Random, u32);

impl Draws {
    fn new(seed: u32) -> Self {
        Self(Random::new(seed, 0), 0)
    }

    fn next(&mut self) -> f64 {
        self.1 += 1;
        2.0 * f64::from(self.0.single(self.1)) - 1.0
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.next(), self.next(), self.next());
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

pub(super) fn cases(table: &mut Table) {
    for (case, values) in [
        ("1 : 1e-3 : 1e-6", [1.0, 1e-3, -1e-6]),
        ("1 : 1e-6 : 1e-12", [-1.0, 1e-6, 1e-12]),
        ("two equal", [1.0, 1.0, -0.3]),
        ("two 1e-6 apart", [1.0, 1.0 + 1e-6, 0.5]),
        ("all equal", [0.7, 0.7, 0.7]),
        ("opposite", [1.0, -1.0, 1e-3]),
        ("of rank one", [1.0, 0.0, 0.0]),
        ("of size 1e-30", [1e-30, -3e-31, 2e-33]),
        ("of size 1e30", [1e30, -3e29, 2e27]),
    ] {
        decompositions(table, case, values);
    }
    for (case, angles, inverse) in [
        ("long edges", [0.1, FRAC_PI_2], [1.0, 0.5]),
        ("edges of 1e-2 rad", [1e-3, 1e-2], [1.0, 1.0]),
        ("edges of 1e-4 rad", [1e-5, 1e-4], [1.0, 0.9]),
        ("edges that end far away", [0.1, 1.0], [1.0, 1e-6]),
        ("edges into infinity", [0.1, 1.0], [1.0, 0.0]),
        ("edges next to the receiver", [0.1, 1.0], [1e6, 1e5]),
    ] {
        edges(table, case, angles, inverse);
    }
}

/// Errors of eigenvalues and of A v − λ v in ulp of the largest eigenvalue, for random eigenvectors.
fn decompositions(table: &mut Table, case: &str, values: [f64; 3]) {
    let mut draws = Draws::new(4);
    let (mut value_errors, mut residuals) = (Vec::new(), Vec::new());
    for _ in 0..64 {
        let mut matrices = [[0.0f32; 16]; 6];
        for lane in 0..16 {
            let u = draws.direction();
            let v = u.cross(draws.direction()).normalize();
            let rotation = DMat3::from_cols(u, v, u.cross(v));
            let a = rotation * DMat3::from_diagonal(DVec3::from_array(values)) * rotation.transpose();
            let entries = [a.x_axis.x, a.x_axis.y, a.x_axis.z, a.y_axis.y, a.y_axis.z, a.z_axis.z];
            for (row, entry) in matrices.iter_mut().zip(entries) {
                row[lane] = entry as f32;
            }
        }
        let mut results = [[[0.0f32; 16]; 12]];
        decompose3(Level::detect(), &[matrices], &mut results);
        for lane in 0..16 {
            let [xx, xy, xz, yy, yz, zz] = matrices.map(|row| f64::from(row[lane]));
            let a = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
            let exact = eigenvalues(a);
            let at = |row: usize| f64::from(results[0][row][lane]);
            let size = ulp(exact[0].abs().max(exact[2].abs()));
            let mut computed = [0, 1, 2].map(at);
            for (i, value) in computed.into_iter().enumerate() {
                let v = DVec3::new(at(3 + 3 * i), at(4 + 3 * i), at(5 + 3 * i));
                residuals.push((a * v - value * v).length() / size);
                residuals.push((v.length() - 1.0).abs() / ulp(1.0));
            }
            computed.sort_by(f64::total_cmp);
            value_errors
                .extend(computed.iter().zip(exact).map(|(computed, exact)| (computed - exact).abs() / size));
        }
    }
    // Four sweeps of rotations, each with a dozen roundings of numbers up to the largest value.
    table.units(
        format!("eigenvalues of 3 x 3, {case}, of the largest"),
        8.0,
        worst(value_errors.into_iter()),
    );
    table.units(
        format!("eigenvectors of 3 x 3, {case}: A v − λ v, of λ"),
        10.0,
        worst(residuals.into_iter()),
    );
}

/// Eigenvalues in ascending order, by Jacobi rotations.
fn eigenvalues(a: DMat3) -> [f64; 3] {
    let mut a = a.to_cols_array_2d();
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let tan = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let cos = 1.0 / tan.hypot(1.0);
            let sin = tan * cos;
            for row in &mut a {
                (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
            }
            let (first, second) = (a[p], a[q]);
            a[p] = core::array::from_fn(|k| cos * first[k] - sin * second[k]);
            a[q] = core::array::from_fn(|k| sin * first[k] + cos * second[k]);
        }
    }
    let mut values = [a[0][0], a[1][1], a[2][2]];
    values.sort_by(f64::total_cmp);
    values
}

/// Gradients and Hessians of random edges against integrals along the edge, in ulp of the largest possible
/// contribution of an edge of that angle and distance.
fn edges(table: &mut Table, case: &str, [least, most]: [f64; 2], inverse: [f64; 2]) {
    let mut draws = Draws::new(5);
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for _ in 0..2048 {
        let a = draws.direction();
        let side = a.cross(draws.direction()).normalize();
        let angle = least * (most / least).powf(draws.next().abs());
        let b = angle.cos() * a + angle.sin() * side;
        let [a, b] = [a, b].map(|v| DVec3::new(v.x, v.y, v.z.abs()).as_vec3());
        let [u, v] = inverse.map(|distance| distance as f32);
        let computed = flux_of(a.to_array(), u, b.to_array(), v);
        let (a, b, u, v) = (a.as_dvec3().normalize(), b.as_dvec3().normalize(), f64::from(u), f64::from(v));
        let angle = a.cross(b).length().atan2(a.dot(b));
        let (gradient, hessian) = integrated(a, u, b, v);
        let near = u.max(v);
        let distance = |computed: &[f32], exact: &[f64]| {
            let squares =
                computed.iter().zip(exact).map(|(computed, exact)| (f64::from(*computed) - exact).powi(2));
            squares.sum::<f64>().sqrt()
        };
        first.push(distance(&computed.gradient, &gradient) / (angle * near) / ulp(1.0));
        second.push(distance(&computed.hessian, &hessian) / (angle * near * near) / ulp(1.0));
    }
    // Twenty roundings of the largest term; f32 unit vectors themselves have an error of one ulp.
    table.units(format!("gradient of irradiance, {case}, of angle / r"), 8.0, worst(first.into_iter()));
    table.units(format!("Hessian of irradiance, {case}, of angle / r²"), 8.0, worst(second.into_iter()));
}

/// Integrals ∫ cos ν/r ds and ∫ 4 cos Sym(ν ⊗ w)/r² ds along an edge, by Simpson's rule over the angle.
fn integrated(a: DVec3, u: f64, b: DVec3, v: f64) -> ([f64; 2], [f64; 3]) {
    const STEPS: u32 = 256;
    let normal = a.cross(b);
    let sin = normal.length();
    let (angle, nu) = (sin.atan2(a.dot(b)), normal / sin);
    let (mut gradient, mut hessian) = ([0.0; 2], [0.0; 3]);
    for step in 0..=STEPS {
        let weight = match step {
            0 | STEPS => 1.0,
            _ if step % 2 == 1 => 4.0,
            _ => 2.0,
        } / f64::from(3 * STEPS);
        let at = f64::from(step) / f64::from(STEPS);
        // The inverse distance of a line in space is linear in the direction.
        let (p, q) = ((angle * (1.0 - at)).sin() / sin, (angle * at).sin() / sin);
        let (w, inverse) = (p * a + q * b, p * u + q * v);
        let slope = w.z * inverse * weight * angle;
        let bend = 4.0 * slope * inverse;
        gradient[0] += nu.x * slope;
        gradient[1] += nu.y * slope;
        hessian[0] += bend * nu.x * w.x;
        hessian[1] += 0.5 * bend * (nu.x * w.y + nu.y * w.x);
        hessian[2] += bend * nu.y * w.y;
    }
    (gradient, hessian)
}
