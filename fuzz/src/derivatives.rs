//! Derivatives of irradiance records. All levels agree to the bit: eigen decompositions, edges, hemispheres
//! by both kernels. Eigenvalues are compared with f64, sums with scalar references; radii stay within their
//! limits for any hemisphere.

use crate::numbers::{coordinate, fraction};
use arbitrary::{Result, Unstructured};
use halflight_core::cache::irradiance::derivatives::{CellFlux, closed_mesh, triangulated, ward_heckbert};
use halflight_core::cache::irradiance::metric::{Metric, Settings};
use halflight_core::cache::irradiance::validity;
use halflight_core::cache::irradiance::{Derivatives, Hemisphere};
use halflight_core::memory::{Arena, Line};
use halflight_core::sampling::warp::cosine_hemisphere;
use halflight_simd::Level;
use halflight_simd::kernels::eigen::{
    Eigen2, Eigen3, Matrices2, Matrices3, decompose2, decompose3, symmetric2, symmetric3,
};
use halflight_simd::kernels::jumps::Sums;
use halflight_simd::kernels::mesh::{Mesh, Rule};

/// One input.
pub fn run(data: &[u8]) {
    let mut input = Unstructured::new(data);
    let _ = eigen(&mut input).and_then(|()| hemisphere(&mut input));
}

/// Eigen decompositions of any matrices, with some equal entries and some of very different size.
fn eigen(input: &mut Unstructured) -> Result<()> {
    let mut entries = [[0.0; 16]; 6];
    for entry in entries.as_flattened_mut() {
        *entry = coordinate(input)?;
    }
    let small: Matrices2 = [entries[0], entries[1], entries[2]];
    let large: Matrices3 = entries;
    for level in Level::detect().and_below() {
        let (mut found, mut found3) = ([[[0.0; 16]; 4]], [[[0.0; 16]; 12]]);
        decompose2(level, &[small], &mut found);
        decompose3(level, &[large], &mut found3);
        for i in 0..16 {
            let matrix = small.map(|row| row[i]);
            let Eigen2 { values, axis } = symmetric2(|x| x, matrix);
            if matrix.iter().all(|x| x.is_finite()) {
                same(level, &matrix, values.into_iter().chain(axis), found[0].iter().map(|row| row[i]));
                check2(matrix, values, axis);
            }
            let matrix = large.map(|row| row[i]);
            if matrix.iter().all(|x| x.is_finite()) {
                let Eigen3 { values, vectors } = symmetric3(|x| x, matrix);
                let wanted = values.into_iter().chain(vectors.as_flattened().iter().copied());
                same(level, &matrix, wanted, found3[0].iter().map(|row| row[i]));
                check3(matrix, values, vectors);
            }
        }
    }
    Ok(())
}

/// Asserts equal bits, or NaN in both.
fn same(level: Level, of: &[f32], wanted: impl Iterator<Item = f32>, found: impl Iterator<Item = f32>) {
    for (wanted, found) in wanted.zip(found) {
        // min and max may return either of two zeros.
        let zeros = wanted == 0.0 && found == 0.0;
        let same = wanted.to_bits() == found.to_bits() || zeros || wanted.is_nan() && found.is_nan();
        assert!(same, "{level:?} of {of:?}: {found:e} for {wanted:e}");
    }
}

/// Asserts eigenvalues within four units in the last place, where f32 holds them and the smaller is at least
/// 1e-30 of the larger.
fn check2([a, b, c]: [f32; 3], values: [f32; 2], axis: [f32; 2]) {
    let [xx, xy, yy] = [a, b, c].map(f64::from);
    let (mean, radius) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    let large = if mean < 0.0 { mean - radius } else { mean + radius };
    let product = |a: f64, b: f64| (a * b, a.mul_add(b, -(a * b)));
    let ((p, p_rest), (q, q_rest)) = (product(xx, yy), product(xy, xy));
    let small = if large == 0.0 { 0.0 } else { ((p - q) + (p_rest - q_rest)) / large };
    let unit = |value: f64| (value.abs() * f64::from(f32::EPSILON)).max(f64::from(f32::from_bits(1)));
    let off = |found: f32, wanted: f64| (f64::from(found) - wanted).abs() / unit(wanted);
    // Values of equal magnitude in f32 may come in either order.
    let swapped = large as f32 == -(small as f32) && f64::from(values[0]) * large < 0.0;
    let (large, small) = if swapped { (small, large) } else { (large, small) };
    let stored = f64::from(f32::MAX) * 0.99;
    if large.abs() < stored {
        assert!(off(values[0], large) <= 4.0, "{a:e} {b:e} {c:e}: {values:?} for {large:e}");
    }
    if small.abs() < stored && (small.abs() > 1e-30 * large.abs() || b == 0.0) {
        assert!(off(values[1], small) <= 4.0, "{a:e} {b:e} {c:e}: {values:?} for {small:e}");
    }
    let ([x, y], value) = (axis.map(f64::from), f64::from(values[0]));
    assert!((x.hypot(y) - 1.0).abs() < 1e-6, "{a:e} {b:e} {c:e}: {axis:?}");
    // The vector is an eigenvector of this value.
    let residual = (xx * x + xy * y - value * x).hypot(xy * x + yy * y - value * y);
    let tolerance = 1e-6 * large.abs() + 2.0 * f64::from(f32::from_bits(1));
    assert!(value.is_infinite() || residual <= tolerance, "{a:e} {b:e} {c:e}: {values:?} along {axis:?}");
}

/// Asserts residuals small relative to the largest entry, and unit vectors.
fn check3(matrix: [f32; 6], values: [f32; 3], vectors: [[f32; 3]; 3]) {
    let [xx, xy, xz, yy, yz, zz] = matrix.map(f64::from);
    let norm = matrix.iter().fold(0.0, |norm, x| x.abs().max(norm));
    if norm > f32::MAX / 4.0 {
        return;
    }
    let tolerance = 3e-6 * f64::from(norm) + 4.0 * f64::from(f32::from_bits(1));
    for (value, v) in values.into_iter().zip(vectors) {
        let [x, y, z] = v.map(f64::from);
        assert!((x * x + y * y + z * z - 1.0).abs() < 1e-5, "{matrix:?}: {v:?}");
        let rows = [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z];
        for (row, x) in rows.into_iter().zip([x, y, z]) {
            assert!((row - f64::from(value) * x).abs() <= tolerance, "{matrix:?}: {values:?} {v:?}");
        }
    }
}

/// A hemisphere of a few strata with any radiances and distances.
fn hemisphere(input: &mut Unstructured) -> Result<()> {
    let n = input.int_in_range(1..=18)?;
    let (mut radiance, mut inverse) = (Vec::new(), Vec::new());
    let (mut directions, mut normals) = (Vec::new(), Vec::new());
    // The last stratum of the input repeats, so that short inputs make large hemispheres.
    let mut last = ([0.5; 3], 1.0);
    for at in 0..n * n {
        let (i, j) = (at / n, at % n);
        if !input.is_empty() {
            let light = coordinate(input)?.abs();
            last = ([light, 0.5 * light, coordinate(input)?.abs()], coordinate(input)?.abs());
        }
        let u = [j, i].map(|k| (k as f32 + fraction(input).unwrap_or(0.5)) / n as f32);
        radiance.push(last.0);
        inverse.push(last.1);
        directions.push(cosine_hemisphere(u).to_array());
        normals.push([0.0, 0.0, -1.0]);
    }
    let hemisphere = Hemisphere::new(n, &radiance, &inverse, &directions).expect("n² of each");
    let hemisphere = hemisphere.with_normals(&normals).expect("n² of each");
    let mut lines = vec![Line([0; 64]); CellFlux::footprint(n).bytes() / 64];
    let tables = CellFlux::build(n, &mut Arena::over(&mut lines));
    let tables = tables.expect("the footprint is enough");

    let of = |level| {
        [
            tables.derivatives(level, &hemisphere).expect("the tables of n"),
            closed_mesh(level, &hemisphere),
            triangulated(level, &hemisphere),
            ward_heckbert(&hemisphere),
        ]
    };
    let found = of(Level::BASELINE);
    for level in Level::detect().and_below() {
        for (found, again) in found.iter().zip(of(level)) {
            same(level, &inverse, numbers(found), numbers(&again));
        }
    }
    // Sums of ordinary numbers agree up to the order of summation.
    let ordinary = |x: &f32| *x == 0.0 || (1e-3..1e3).contains(x);
    if radiance.as_flattened().iter().all(ordinary) && inverse.iter().all(ordinary) {
        for (rule, found) in [(Rule::DepthAware, &found[1]), (Rule::Farthest, &found[2])] {
            let mesh =
                Mesh { n, radiance: &radiance, inverse_distance: &inverse, directions: &directions, rule };
            let Sums { gradient, hessian, .. } = mesh.reference();
            let most = inverse.iter().fold(0.0f32, |most, u| most.max(*u));
            let light = radiance.as_flattened().iter().fold(0.0f32, |most, l| most.max(*l));
            let near = |found: f32, wanted: f32, size: f32| {
                assert!((found - wanted).abs() <= 1e-4 * size, "{rule:?} {n}: {found} for {wanted}");
            };
            // Bound of each term, for a few hundred edges.
            for (found, wanted) in found.gradient.iter().zip(gradient) {
                near(found.x, wanted[0], 10.0 * light * most);
                near(found.y, wanted[1], 10.0 * light * most);
            }
            near(found.hessian.xx, hessian[0], 40.0 * light * most * most);
            near(found.hessian.xy, hessian[1], 40.0 * light * most * most);
            near(found.hessian.yy, hessian[2], 40.0 * light * most * most);
        }
    }
    radii(&found);
    for metric in Metric::ALL {
        let derivatives = metric.derivatives(Level::detect(), &tables, &hemisphere);
        radii(&[derivatives.expect("tables and normals are there")]);
    }
    Ok(())
}

fn numbers(derivatives: &Derivatives) -> impl Iterator<Item = f32> {
    let Derivatives { irradiance, gradient, rotation, hessian, open_hessian, .. } = *derivatives;
    let vectors = gradient.into_iter().chain(rotation).flat_map(|v| v.to_array());
    let hessians = [hessian, open_hessian].into_iter().flat_map(|h| [h.xx, h.xy, h.yy]);
    irradiance.to_array().into_iter().chain(vectors).chain(hessians)
}

/// Asserts that every metric gives an ellipse within its limits.
fn radii(of: &[Derivatives]) {
    for derivatives in of {
        for metric in Metric::ALL {
            let settings = Settings { least: 0.01, ..Settings::new(metric, 10.0) };
            let found = validity(&settings, derivatives);
            let [short, long] = found.radii;
            let within = 0.01 <= short && short <= long && long <= settings.most;
            assert!(within, "{metric:?}: {found:?} of {derivatives:?}");
            assert!(long <= 2.0001 * short, "{metric:?}: {found:?} of {derivatives:?}");
            assert!((0.0..=1.0).contains(&found.gradient_scale), "{metric:?}: {found:?}");
            assert!((found.axis.length() - 1.0).abs() < 1e-5, "{metric:?}: {found:?} of {derivatives:?}");
        }
    }
}
