//! Kernels against f64, over difficult inputs. Errors are in ulp, the distance of neighbouring f32: of the
//! value, or of 1 for terms of a sum of order 1.

use super::Table;
use glam::{DVec3, Vec3};
use halflight_core::Level;
use halflight_core::bsdf::fresnel;
use halflight_core::bsdf::ggx::Ggx;
use halflight_core::geometry::Frame;
use halflight_core::sampling::{Random, sin_cos_turns};
use halflight_simd::kernels::eigen::decompose2;
use halflight_simd::kernels::triangles::{Shear, intersect};

/// Distance of neighbouring f32 at `exact`.
pub(super) fn ulp(exact: f64) -> f64 {
    let exponent = exact.abs().max(f64::from(f32::MIN_POSITIVE)).log2().floor();
    (exponent - 23.0).exp2()
}

fn ulps(computed: f32, exact: f64) -> f64 {
    (f64::from(computed) - exact).abs() / ulp(exact)
}

/// Error in ulp of the value, or of 1 if the value is smaller.
fn ulps_of_one(computed: f32, exact: f64) -> f64 {
    (f64::from(computed) - exact).abs() / ulp(exact.abs().max(1.0))
}

pub(super) fn worst(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |worst, error| if error.is_nan() { f64::INFINITY } else { worst.max(error) })
}

pub(super) fn cases(table: &mut Table) {
    let turns = (0..=200_000).map(|i| i as f32 / 200_000.0).flat_map(|u| {
        let (sin, cos) = sin_cos_turns(u);
        let angle = f64::from(u) * core::f64::consts::TAU;
        [ulps_of_one(sin, angle.sin()), ulps_of_one(cos, angle.cos())]
    });
    // Two roundings of numbers up to 1, one of the angle.
    table.units("sine and cosine of a turn, of 1", 2.0, worst(turns));
    fresnel_cases(table);
    ggx(table);
    frames(table);
    eigen(table);
    triangles(table);
}

/// Cosines down to 1e-6, indices from 0.1 to 10 and next to 1.
fn fresnel_cases(table: &mut Table) {
    let exact = |c: f64, eta: f64| {
        let g2 = (eta - 1.0) * (eta + 1.0) + c * c;
        if g2 <= 0.0 {
            return 1.0;
        }
        let g = g2.sqrt();
        let (s, p) = ((c - g) / (c + g), (eta * eta * c - g) / (eta * eta * c + g));
        0.5 * (s * s + p * p)
    };
    let cosines = [1.0f32, 1.0 - 1e-7, 0.9, 0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];
    for (case, indices) in [
        ("Fresnel, indices 0.1 to 10, of 1", vec![0.1f32, 0.5, 0.75, 1.33, 1.5, 2.4, 10.0]),
        ("Fresnel, indices next to 1, of 1", vec![1.0, 1.0 + 1e-6, 1.0 - 1e-6, 1.0 + 1e-3, 1.0 - 1e-3]),
    ] {
        let errors = cosines.iter().flat_map(|&c| {
            indices
                .iter()
                .filter(move |&&eta| {
                    // The slope is infinite at the onset of total reflection.
                    let g2 = f64::from(eta) * f64::from(eta) - 1.0 + f64::from(c) * f64::from(c);
                    g2 < 0.0 || g2 > 1e-3 * f64::from(c) * f64::from(c)
                })
                .map(move |&eta| {
                    ulps_of_one(fresnel::dielectric(c, eta), exact(f64::from(c), f64::from(eta)))
                })
        });
        // The larger of both terms is a square of a quotient of rounded sums: six roundings, twice.
        table.units(case, 12.0, worst(errors));
    }
}

/// D and G1 over all roughnesses and angles; a lobe of alpha 1e-4 has a peak of 3e7.
fn ggx(table: &mut Table) {
    const ALPHAS: [f32; 6] = [1e-4, 1e-3, 1e-2, 0.1, 0.5, 1.0];
    const ANGLES: [f64; 10] = [0.0, 1e-8, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.7, 1.5, 1.57];
    let all = || ALPHAS.into_iter().flat_map(|alpha| ANGLES.map(|angle| (alpha, angle)));
    let direction = |angle: f64| DVec3::new(angle.sin() * 0.6, angle.sin() * 0.8, angle.cos()).as_vec3();
    let density = all().map(|(alpha, angle)| {
        let m = direction(angle);
        let (d, a2) = (m.as_dvec3(), f64::from(alpha) * f64::from(alpha));
        let (xy2, z2) = (d.x * d.x + d.y * d.y, d.z * d.z);
        let q = (xy2 + z2) / (xy2 + a2 * z2);
        ulps(Ggx::new(alpha).density(m.into()), a2 / core::f64::consts::PI * q * q)
    });
    // Ten roundings, those before the square count twice.
    table.units("GGX density, alpha 1e-4 to 1, of itself", 16.0, worst(density));
    let masking = all().map(|(alpha, angle)| {
        let v = direction(angle);
        let (d, a2) = (v.as_dvec3(), f64::from(alpha) * f64::from(alpha));
        let stretch = (a2 * (d.x * d.x + d.y * d.y) + d.z * d.z).sqrt();
        ulps(Ggx::new(alpha).masking(v.into()), 2.0 * d.z.abs() / (d.z.abs() + stretch))
    });
    table.units("Smith masking, alpha 1e-4 to 1, of itself", 6.0, worst(masking));
}

/// Frames around normals, poles included: vectors keep their length.
fn frames(table: &mut Table) {
    let random = Random::new(1, 0);
    let normals = (0..4096u32).map(|i| {
        let small = [1.0f32, 1e-3, 1e-6, 0.0][i as usize % 4];
        let [x, y] = [0, 1].map(|k| small * (2.0 * random.single(2 * i + k) - 1.0));
        Vec3::new(x, y, if i % 8 < 4 { 1.0 } else { -1.0 }).normalize()
    });
    let errors = normals.map(|normal| {
        let frame = Frame::from_normal(normal);
        let v = frame.to_world(Vec3::new(0.48, -0.6, 0.64));
        let length = v.as_dvec3().length();
        (length - f64::from(Vec3::new(0.48, -0.6, 0.64).length())).abs() / ulp(1.0)
    });
    table.units("frames around normals, lengths, of 1", 4.0, worst(errors));
}

/// Eigenvalues 1 : 1 to 1 : 1e-12, both signs, any direction.
fn eigen(table: &mut Table) {
    let random = Random::new(2, 0);
    for ratio in [1.0f64, 1e-3, 1e-6, 1e-12] {
        let mut errors = Vec::new();
        for batch in 0..256u32 {
            let mut matrices = [[0.0f32; 16]; 3];
            for lane in 0..16 {
                let draw = |k: u32| f64::from(random.single(64 * batch + 4 * lane as u32 + k));
                let small = ratio * if draw(0) < 0.5 { -1.0 } else { 1.0 };
                let (sin, cos) = (core::f64::consts::TAU * draw(1)).sin_cos();
                let entries =
                    [cos * cos + small * sin * sin, (1.0 - small) * sin * cos, sin * sin + small * cos * cos];
                for (row, entry) in matrices.iter_mut().zip(entries) {
                    row[lane] = entry as f32;
                }
            }
            let mut results = [[[0.0f32; 16]; 4]];
            decompose2(Level::detect(), &[matrices], &mut results);
            for lane in 0..16 {
                // Eigenvalues of the rounded matrix. Products of f32 are exact in f64, and so are small
                // differences.
                let [a, b, c] = [0, 1, 2].map(|row| f64::from(matrices[row][lane]));
                let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
                let radius = (half * half + b * b).sqrt();
                let large = if mean < 0.0 { mean - radius } else { mean + radius };
                let small = (a * c - b * b) / large;
                errors.push(ulps(results[0][0][lane], large));
                errors.push(ulps(results[0][1][lane], small));
            }
        }
        table.units(
            format!("eigenvalues of 2 x 2, 1 : {ratio:e}, of themselves"),
            4.0,
            worst(errors.into_iter()),
        );
    }
}

/// Distances to triangles of side 1e-6 to 1e6, at a distance of one.
fn triangles(table: &mut Table) {
    for exponent in [-6, -3, 0, 3, 6] {
        let side = 10f32.powi(exponent);
        let random = Random::new(3, exponent.unsigned_abs());
        let mut hits = 0;
        let errors: Vec<f64> = (0..4096u32)
            .filter_map(|i| {
                let draw = |k: u32| 2.0 * random.single(8 * i + k) - 1.0;
                let direction = Vec3::new(0.3 * draw(0), 0.3 * draw(1), 1.0);
                let centre = direction;
                // The ray passes through the centroid.
                let tilt = [0.2 * draw(2), 0.2 * draw(3)];
                let corners = [
                    centre + side * Vec3::new(-1.0, -0.5, tilt[0]),
                    centre + side * Vec3::new(1.0, -0.5, tilt[1]),
                    centre + side * Vec3::new(0.0, 1.0, -tilt[0] - tilt[1]),
                ];
                let shear = Shear::new(direction.to_array());
                let (t, ..) = intersect([0.0; 3], &shear, f32::MAX, corners.map(|c| c.to_array()))?;
                hits += 1;
                // Plane of the rounded corners.
                let [a, b, c] = corners.map(|corner| corner.as_dvec3());
                let normal = (b - a).cross(c - a);
                let exact = normal.dot(a) / normal.dot(direction.as_dvec3());
                // In ulp of the largest coordinate.
                Some((f64::from(t) - exact).abs() / ulp(f64::from(side.max(1.0))))
            })
            .collect();
        let worst = if hits > 4000 { worst(errors.into_iter()) } else { f64::INFINITY };
        table.units(
            format!("distance to triangles of side 1e{exponent}, of the largest coordinate"),
            8.0,
            worst,
        );
    }
}
