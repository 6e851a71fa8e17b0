//! Radiance coefficients. Outer products and dot products of half floats equal their scalar references to the
//! bit on every level; coefficients, derivatives and lookups of any hemisphere have the same bits on every
//! level and do not panic; lobes and rotations of any numbers do not panic.

use crate::numbers::{coordinate, fraction};
use arbitrary::{Result, Unstructured};
use glam::{Mat3, Vec2, Vec3};
use halflight_core::Level;
use halflight_core::cache::irradiance::Hemisphere;
use halflight_core::cache::radiance::derivatives::{border_flux, displaced, unoccluded};
use halflight_core::cache::radiance::{
    Basis, CoefficientPool, Coefficients, Expansion, Representation, StrataTables, Weights, mirrored_viewer,
    sh, zernike,
};
use halflight_core::memory::{Arena, Line};
use halflight_core::sampling::warp::cosine_hemisphere;
use halflight_simd::kernels::dots::Dots;
use halflight_simd::kernels::outer::Outer;

/// One input.
pub fn run(data: &[u8]) {
    let mut input = Unstructured::new(data);
    let _ = sums(&mut input).and_then(|()| directions(&mut input)).and_then(|()| hemisphere(&mut input));
}

/// Asserts equal bits, or NaN in both.
fn same(level: Level, wanted: &[f32], found: &[f32]) {
    assert_eq!(wanted.len(), found.len());
    for (wanted, found) in wanted.iter().zip(found) {
        let same = wanted.to_bits() == found.to_bits() || wanted.is_nan() && found.is_nan();
        assert!(same, "{level:?}: {found:e} for {wanted:e}");
    }
}

/// Both kernels with any numbers, and with lengths that do not fit.
fn sums(input: &mut Unstructured) -> Result<()> {
    let (groups, rows) = (input.int_in_range(0..=3usize)?, input.int_in_range(0..=5)?);
    let (mut factors, mut table, mut halves) = (vec![[0.0; 3]; rows], Vec::new(), Vec::new());
    for factor in factors.as_flattened_mut() {
        *factor = coordinate(input)?;
    }
    for _ in 0..input.int_in_range(0..=12)? {
        let mut entries = [0.0; 16];
        for entry in &mut entries {
            *entry = coordinate(input)?;
        }
        table.push(entries);
        halves.push(input.arbitrary::<[u16; 16]>()?);
    }
    let weights = &table[..groups.min(table.len())];
    let mut wanted = vec![[[0.5; 16]; 3]; groups];
    Outer { factors: &factors, table: &table, sums: &mut wanted }.add(Level::SCALAR);
    let mut dots = [7.0; 4];
    Dots { rows: &halves, weights, out: &mut dots }.compute(Level::SCALAR);
    for level in Level::detect().and_below() {
        let mut found = vec![[[0.5; 16]; 3]; groups];
        Outer { factors: &factors, table: &table, sums: &mut found }.add(level);
        same(level, wanted.as_flattened().as_flattened(), found.as_flattened().as_flattened());
        let mut found = [7.0; 4];
        Dots { rows: &halves, weights, out: &mut found }.compute(level);
        same(level, &dots, &found);
    }
    Ok(())
}

/// Functions, viewers and rotations of any vectors.
fn directions(input: &mut Unstructured) -> Result<()> {
    let mut vectors = [Vec3::ZERO; 3];
    for vector in &mut vectors {
        *vector = Vec3::new(coordinate(input)?, coordinate(input)?, coordinate(input)?);
    }
    let [a, b, c] = vectors;
    let _ = mirrored_viewer(a, b, c);
    let degree = input.int_in_range(0..=12)?;
    let values = zernike::values(degree, [a.x, a.y]);
    let beyond = zernike::count(degree.min(zernike::DEGREE_MAX));
    assert!(values[beyond..].iter().all(|value| *value == 0.0));
    let _ = zernike::gradients(degree, [a.x, a.y]);
    let _ = sh::gradients(degree, a.to_array());
    let rotation = sh::ShRotation::new(&Mat3::from_cols(a, b, c), degree);
    let turned = rotation.apply(&sh::values(degree, a.to_array()));
    assert!(turned[0].is_nan() || (turned[0] - 0.282_094_8).abs() < 1e-6);
    Ok(())
}

/// A hemisphere of a few strata with any radiances and distances.
fn hemisphere(input: &mut Unstructured) -> Result<()> {
    let (n, degree) = (input.int_in_range(1..=12)?, input.int_in_range(0..=8)?);
    let (mut radiance, mut inverse) = (Vec::new(), Vec::new());
    let (mut directions, mut normals) = (Vec::new(), Vec::new());
    // The last stratum of the input repeats, so that short inputs make large hemispheres.
    let mut last = ([0.5; 3], 1.0);
    for at in 0..n * n {
        if !input.is_empty() {
            let light = coordinate(input)?.abs();
            last = ([light, 0.5 * light, coordinate(input)?.abs()], coordinate(input)?.abs());
        }
        let u = [at % n, at / n].map(|k| (k as f32 + fraction(input).unwrap_or(0.5)) / n as f32);
        radiance.push(last.0);
        inverse.push(last.1);
        directions.push(cosine_hemisphere(u).to_array());
        normals.push([0.0, 0.0, -1.0]);
    }
    let hemisphere = Hemisphere::new(n, &radiance, &inverse, &directions).expect("n² of each");
    let hemisphere = hemisphere.with_normals(&normals).expect("n² of each");
    let mut lines = vec![Line([0; 64]); StrataTables::footprint(n, degree).bytes() / 64];
    let tables = StrataTables::build(n, degree, &mut Arena::new(bytemuck::cast_slice_mut(&mut lines)));
    let tables = tables.expect("the footprint is enough");
    let _ = (unoccluded(&tables, &hemisphere), displaced(&tables, &hemisphere, coordinate(input)?));

    harmonics((n, degree), &hemisphere, input)?;
    let of = |level| {
        let light = Coefficients::project(level, &tables, &hemisphere).expect("tables of n");
        let derivatives = border_flux(level, &tables, &hemisphere).expect("tables of n");
        (light, derivatives)
    };
    let (light, derivatives) = of(Level::BASELINE);
    let (unit, delta) = (coordinate(input)?, Vec2::new(coordinate(input)?, coordinate(input)?));
    let representation = Representation { basis: Basis::Zernike, degree };
    let mut lines = vec![Line([0; 64]); CoefficientPool::footprint(1, representation).bytes() / 64];
    let pool = CoefficientPool::new(1, representation, &mut Arena::over(&mut lines));
    let mut pool = pool.expect("the footprint is enough");
    let record =
        pool.push(&Expansion::zernike(&light, &derivatives.gradients), unit).expect("memory for one record");
    let weights = Weights::new(&light.values[1][..zernike::count(degree)]);
    let reflected = pool.reflected(Level::BASELINE, &record, &weights, delta).to_array();
    for level in Level::detect().and_below() {
        let (again, more) = of(level);
        same(level, light.values.as_flattened(), again.values.as_flattened());
        let gradients = derivatives.gradients.as_flattened().as_flattened();
        same(level, gradients, more.gradients.as_flattened().as_flattened());
        for (wanted, found) in derivatives.hessians.iter().zip(more.hessians) {
            same(level, &[wanted.xx, wanted.xy, wanted.yy], &[found.xx, found.xy, found.yy]);
        }
        same(level, &reflected, &pool.reflected(level, &record, &weights, delta).to_array());
    }
    Ok(())
}

/// Spherical harmonics of the same hemisphere: projection and look-up have the same bits on every level, and
/// gradients, rotations and any order do not panic.
fn harmonics((n, order): (usize, usize), hemisphere: &Hemisphere, input: &mut Unstructured) -> Result<()> {
    let mut lines = vec![Line([0; 64]); sh::ShTables::footprint(n, order).bytes() / 64];
    let tables =
        sh::ShTables::build(n, order, &mut Arena::over(&mut lines)).expect("the footprint is enough");
    let _ = sh::displaced(&tables, hemisphere, coordinate(input)?);
    let gradients = sh::unoccluded(&tables, hemisphere).expect("normals");
    let light = sh::ShCoefficients::project(Level::BASELINE, &tables, hemisphere).expect("tables of n");
    let representation = Representation { basis: Basis::SphericalHarmonics, degree: order };
    let mut lines = vec![Line([0; 64]); CoefficientPool::footprint(1, representation).bytes() / 64];
    let mut pool =
        CoefficientPool::new(1, representation, &mut Arena::over(&mut lines)).expect("the footprint");
    let record = pool.push(&Expansion::spherical_harmonics(&light, &gradients), coordinate(input)?);
    let record = record.expect("memory for one record");
    let turned =
        sh::ShRotation::new(&Mat3::from_rotation_y(coordinate(input)?), order).apply(&light.values[0]);
    // Orders of lobes may be lower than that of the record.
    let weights = Weights::new(&turned[..sh::count(input.int_in_range(0..=order)?)]);
    let delta = Vec2::new(coordinate(input)?, coordinate(input)?);
    let reflected = pool.reflected(Level::BASELINE, &record, &weights, delta).to_array();
    for level in Level::detect().and_below() {
        let again = sh::ShCoefficients::project(level, &tables, hemisphere).expect("tables of n");
        same(level, light.values.as_flattened(), again.values.as_flattened());
        same(level, &reflected, &pool.reflected(level, &record, &weights, delta).to_array());
    }
    Ok(())
}
