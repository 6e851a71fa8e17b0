//! Time of a look-up, and of coefficients and derivatives of a record, for both bases.

use super::{Row, hemisphere};
use core::hint::black_box;
use glam::{DVec3, Mat3, Vec2, Vec3};
use halflight::pages::Pages;
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
use halflight_test_support::{GatherRays, Hit, Random};
use serde_json::{Value, json};
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
pub(super) struct RadianceTimes {
    /// The basis.
    basis: Basis,
    /// Highest degree.
    degree: usize,
    /// Bytes of a record.
    bytes: usize,
    /// Light of a lobe from ten records, ns.
    records: f64,
    /// Weights of a lobe, ns.
    lobe: f64,
    /// Rotation into the frame of a record, ns; none with Zernike polynomials.
    rotation: Option<f64>,
    /// Projection of a hemisphere of 1024 rays, µs.
    projection: f64,
    /// Gradients of the coefficients, µs.
    gradients: f64,
    /// Derivatives of the irradiance, µs.
    irradiance: f64,
}

impl Row for RadianceTimes {
    fn head() -> String {
        "times: of a look-up in ns, of a record of 1024 rays in µs\n\
         basis    degree  bytes  10 records     lobe rotation  projection gradients irradiance"
            .into()
    }

    fn line(&self) -> String {
        let rotation = self.rotation.map_or("-".to_owned(), |rotation| format!("{rotation:.0}"));
        format!(
            "{:<8} {:>6} {:>6} {:>11.0} {:>8.0} {rotation:>8} {:>11.1} {:>9.1} {:>10.1}",
            self.basis.name(),
            self.degree,
            self.bytes,
            self.records,
            self.lobe,
            self.projection,
            self.gradients,
            self.irradiance,
        )
    }

    fn object(&self) -> Value {
        json!({
            "basis": self.basis.name(),
            "degree": self.degree,
            "bytes": self.bytes,
            "records_ns": self.records,
            "lobe_ns": self.lobe,
            "rotation_ns": self.rotation,
            "projection_us": self.projection,
            "gradients_us": self.gradients,
            "irradiance_us": self.irradiance,
        })
    }
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

/// Times of all representations.
pub(super) fn measure(each: &mut dyn FnMut(&RadianceTimes)) -> Result<(), OutOfMemory> {
    let mut random = Random(7);
    let hit = |w: Vec3| {
        let [x, y] = [w.x, w.y].map(f64::from);
        Hit { radiance: 0.5 + 0.4 * x, inverse: 1.0 + 0.5 * y, normal: DVec3::NEG_Z }
    };
    let rays = GatherRays::new(STRATA, cosine_hemisphere, || random.unit(), hit);
    let Some(hemisphere) = hemisphere(&rays) else { return Ok(()) };
    let mut memory = Pages::new(CellFlux::footprint(STRATA))?;
    let flux = CellFlux::build(STRATA, &mut Arena::over(&mut memory))?;
    let irradiance = seconds(HEMISPHERES, |_| {
        black_box(flux.derivatives(Level::detect(), black_box(&hemisphere)));
    });
    for (basis, degree) in REPRESENTATIONS {
        let representation = Representation { basis, degree };
        let mut memory = Pages::new(CoefficientPool::footprint(RECORDS, representation))?;
        let bytes = memory.len() * 64 / RECORDS;
        let mut pool = CoefficientPool::new(RECORDS, representation, &mut Arena::over(&mut memory))?;
        let mut records = Vec::new();
        let [projection, gradients] = gather(&hemisphere, representation, |light| {
            records = (0..RECORDS).filter_map(|_| pool.push(light, 0.1)).collect();
        })?;
        let [of_records, lobe] = look_ups(representation, &pool, &records, &mut random)?;
        each(&RadianceTimes {
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
    Ok(())
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
            let mut memory = Pages::new(StrataTables::footprint(STRATA, degree))?;
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
            let mut memory = Pages::new(ShTables::footprint(STRATA, degree))?;
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
    let mut memory = Pages::new(LobeTable::footprint(representation.basis))?;
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
