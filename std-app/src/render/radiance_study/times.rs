//! Time of a look-up, and of coefficients and derivatives of a record, for both bases.

use super::Random;
use crate::memory::lines;
use core::hint::black_box;
use glam::{Mat3, Vec2, Vec3};
use halflight_core::Level;
use halflight_core::cache::irradiance::{CellFlux, Hemisphere};
use halflight_core::cache::radiance::derivatives::border_flux;
use halflight_core::cache::radiance::lobes::LobeTable;
use halflight_core::cache::radiance::sh::{self, ShCoefficients, ShRotation, ShTables};
use halflight_core::cache::radiance::{
    Basis, CoefficientPool, Coefficients, Expansion, PooledRecord, Representation, StrataTables, Weights,
};
use halflight_core::memory::{Arena, OutOfMemory};
use halflight_core::sampling::warp::cosine_hemisphere;
use std::time::Instant;

/// Records in memory, and records of a look-up.
const RECORDS: usize = 2000;
const SPEAKING: usize = 10;
/// Look-ups, hemispheres and rotations of a measurement, of which the fastest of [`TRIALS`] counts.
const LOOKUPS: usize = 20_000;
const HEMISPHERES: usize = 100;
const TRIALS: usize = 5;
/// Strata along a side.
const STRATA: usize = 32;

/// Representations of the table.
const REPRESENTATIONS: [(Basis, usize); 5] = [
    (Basis::Zernike, 4),
    (Basis::Zernike, 6),
    (Basis::Zernike, 8),
    (Basis::SphericalHarmonics, 6),
    (Basis::SphericalHarmonics, 9),
];

/// Times of one representation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadianceTimes {
    /// The basis.
    pub basis: Basis,
    /// Highest degree.
    pub degree: usize,
    /// Bytes of a record.
    pub bytes: usize,
    /// Light of a lobe from ten records, ns.
    pub records: f64,
    /// Weights of a lobe, ns.
    pub lobe: f64,
    /// Rotation into the frame of a record, ns; none with Zernike polynomials.
    pub rotation: Option<f64>,
    /// Projection of a hemisphere of 1024 rays, µs.
    pub projection: f64,
    /// Gradients of the coefficients, µs.
    pub gradients: f64,
    /// Derivatives of the irradiance, µs.
    pub irradiance: f64,
}

/// Seconds of each of `count` calls, in the fastest trial.
fn seconds(count: usize, mut call: impl FnMut(usize)) -> f64 {
    let trial = |_| {
        let start = Instant::now();
        (0..count).for_each(&mut call);
        start.elapsed().as_secs_f64()
    };
    (0..TRIALS).map(trial).fold(f64::INFINITY, f64::min) / count as f64
}

/// Light of a room in all strata, with normals.
struct Strata {
    radiance: Vec<[f32; 3]>,
    inverse: Vec<f32>,
    directions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl Strata {
    fn new(random: &mut Random) -> Self {
        let count = STRATA * STRATA;
        let mut unit = || random.unit() as f32;
        let directions: Vec<_> = (0..count)
            .map(|c| {
                let u = [c % STRATA, c / STRATA].map(|k| (k as f32 + unit()) / STRATA as f32);
                cosine_hemisphere(u).to_array()
            })
            .collect();
        Self {
            radiance: (0..count).map(|_| [unit(), unit(), unit()]).collect(),
            inverse: (0..count).map(|_| 0.5 + unit()).collect(),
            directions,
            normals: vec![[0.0, 0.0, -1.0]; count],
        }
    }

    fn hemisphere(&self) -> Option<Hemisphere<'_>> {
        Hemisphere::new(STRATA, &self.radiance, &self.inverse, &self.directions)?.with_normals(&self.normals)
    }
}

/// Times of all representations.
pub(super) fn times() -> Result<Vec<RadianceTimes>, OutOfMemory> {
    let mut random = Random(7);
    let strata = Strata::new(&mut random);
    let Some(hemisphere) = strata.hemisphere() else { return Ok(Vec::new()) };
    let mut memory = lines(CellFlux::footprint(STRATA))?;
    let flux = CellFlux::build(STRATA, &mut Arena::over(&mut memory))?;
    let irradiance = seconds(HEMISPHERES, |_| {
        black_box(flux.derivatives(Level::detect(), black_box(&hemisphere)));
    });
    let mut found = Vec::new();
    for (basis, degree) in REPRESENTATIONS {
        let representation = Representation { basis, degree };
        let mut memory = lines(CoefficientPool::footprint(RECORDS, representation))?;
        let bytes = memory.len() * 64 / RECORDS;
        let mut pool = CoefficientPool::new(RECORDS, representation, &mut Arena::over(&mut memory))?;
        let mut records = Vec::new();
        let [projection, gradients] = gather(&hemisphere, representation, |light| {
            records = (0..RECORDS).filter_map(|_| pool.push(light, 0.1)).collect();
        })?;
        let [of_records, lobe] = look_ups(representation, &pool, &records, &mut random)?;
        found.push(RadianceTimes {
            basis,
            degree,
            bytes,
            records: 1e9 * of_records,
            lobe: 1e9 * lobe,
            rotation: (basis == Basis::SphericalHarmonics).then(|| 1e9 * rotation(degree)),
            projection: 1e6 * projection,
            gradients: 1e6 * gradients,
            irradiance: 1e6 * irradiance,
        });
    }
    Ok(found)
}

/// Seconds of the coefficients of a hemisphere, and of their gradients; `push` gets both.
fn gather(
    hemisphere: &Hemisphere,
    Representation { basis, degree }: Representation,
    push: impl FnOnce(&Expansion),
) -> Result<[f64; 2], OutOfMemory> {
    let level = Level::detect();
    match basis {
        Basis::Zernike => {
            let mut memory = lines(StrataTables::footprint(STRATA, degree))?;
            let tables = StrataTables::build(STRATA, degree, &mut Arena::over(&mut memory))?;
            let project = || Coefficients::project(level, &tables, black_box(hemisphere));
            let differentiate = || border_flux(level, &tables, black_box(hemisphere));
            if let Some((light, changes)) = project().zip(differentiate()) {
                push(&Expansion::zernike(&light, &changes.gradients));
            }
            let projection = seconds(HEMISPHERES, |_| _ = black_box(project()));
            Ok([projection, seconds(HEMISPHERES, |_| _ = black_box(differentiate()))])
        }
        Basis::SphericalHarmonics => {
            let mut memory = lines(ShTables::footprint(STRATA, degree))?;
            let tables = ShTables::build(STRATA, degree, &mut Arena::over(&mut memory))?;
            let project = || ShCoefficients::project(level, &tables, black_box(hemisphere));
            let differentiate = || sh::unoccluded(&tables, black_box(hemisphere));
            if let Some((light, changes)) = project().zip(differentiate()) {
                push(&Expansion::spherical_harmonics(&light, &changes));
            }
            let projection = seconds(HEMISPHERES, |_| _ = black_box(project()));
            Ok([projection, seconds(HEMISPHERES, |_| _ = black_box(differentiate()))])
        }
    }
}

/// Seconds of the light of a lobe from ten records, and of the weights of a lobe.
fn look_ups(
    representation: Representation,
    pool: &CoefficientPool,
    records: &[PooledRecord],
    random: &mut Random,
) -> Result<[f64; 2], OutOfMemory> {
    let mut memory = lines(LobeTable::footprint(representation.basis))?;
    let table = LobeTable::build(representation.basis, &mut Arena::over(&mut memory))?;
    let weights_at = |cos: f32| {
        let coefficients = table.lobe(cos, 0.3).map(|lobe| lobe.turned(Vec2::new(0.6, 0.8)).of(0.9));
        let weights = coefficients.as_ref().and_then(|weights| weights.get(..representation.count()));
        Weights::new(weights.unwrap_or_default())
    };
    let weights = weights_at(0.7);
    let order: Vec<_> = (0..LOOKUPS * SPEAKING).map(|_| (random.unit() * RECORDS as f64) as usize).collect();
    let delta = Vec2::new(0.01, -0.02);
    let of_records = seconds(LOOKUPS, |i| {
        let speaking = order[SPEAKING * i..SPEAKING * (i + 1)].iter();
        let speaking = speaking.filter_map(|&record| Some((0.3, records.get(record)?, delta)));
        black_box(pool.interpolated(Level::detect(), black_box(&weights), speaking));
    });
    let lobe = seconds(LOOKUPS, |i| _ = black_box(weights_at(0.5 + 0.4 * i as f32 / LOOKUPS as f32)));
    Ok([of_records, lobe])
}

/// Seconds of a rotation into the frame of a record.
fn rotation(order: usize) -> f64 {
    let by = Mat3::from_axis_angle(Vec3::new(0.6, 0.8, 0.0), 0.1);
    let coefficients = sh::values(order, [0.6, 0.0, 0.8]);
    seconds(LOOKUPS / 100, |_| _ = black_box(ShRotation::new(black_box(&by), order).apply(&coefficients)))
}
