//! Irradiance caches of any records, queried by sixteen points at once: at every level each point gets the
//! bits of a single query.

use crate::numbers::{fraction, point};
use arbitrary::{Result, Unstructured};
use glam::Vec3;
use halflight_core::Level;
use halflight_core::cache::irradiance::{IrradianceCache, POINTS, Points, QueryPoint, Record, SECTORS};
use halflight_core::geometry::Bounds;
use halflight_core::memory::{Arena, Line};

const MAX_RECORDS: usize = 64;

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    let mut lines = vec![Line([0; 64]); IrradianceCache::footprint(MAX_RECORDS).bytes() / 64];
    let mut arena = Arena::over(&mut lines);
    let bounds = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
    let mut cache =
        IrradianceCache::new(&bounds, MAX_RECORDS, &mut arena).expect("the footprint was granted");
    for _ in 0..input.int_in_range(1..=MAX_RECORDS)? {
        if input.is_empty() {
            break;
        }
        cache.insert(record(input)?);
    }
    if input.arbitrary()? {
        cache.rebuild();
    }
    let (mut points, mut wanted) = (Points::NONE, [None; POINTS]);
    let from = within(input)?;
    for (i, wanted) in wanted.iter_mut().enumerate() {
        let near = input.arbitrary::<u8>()?;
        if near < 16 {
            continue;
        }
        let position = match near {
            16..128 => from + 0.05 * within(input)?,
            128..240 => within(input)?,
            _ => Vec3::from(point(input)?),
        };
        let normal = normal(input)?;
        let beneath = input.arbitrary::<u8>()? < 64;
        let within = if beneath { 0.3 * fraction(input)? } else { f32::INFINITY };
        let query = QueryPoint { position, normal, within };
        points.set(i, &query);
        *wanted = cache.at(&query);
    }
    for level in Level::detect().and_below() {
        let mut known = [None; POINTS];
        cache.at_all(level, &points, &mut known);
        assert_eq!(known, wanted, "{level:?}");
    }
    Ok(())
}

/// A point of the unit cube.
fn within(input: &mut Unstructured) -> Result<Vec3> {
    Ok(Vec3::new(fraction(input)?, fraction(input)?, fraction(input)?))
}

/// A normal, mostly within 0.2 rad of z.
fn normal(input: &mut Unstructured) -> Result<Vec3> {
    let wide = if input.arbitrary::<u8>()? < 200 { 0.2 } else { 4.0 };
    let [x, y] = [fraction(input)?, fraction(input)?].map(|u| wide * (u - 0.5));
    Ok(Vec3::new(x, y, 1.0).normalize())
}

/// A record of unit axes and of numbers of ordinary size.
fn record(input: &mut Unstructured) -> Result<Record> {
    let normal = normal(input)?;
    let mut number = || Ok(2.0 * fraction(input)? - 1.0);
    let (r1, longer, overlap) = (0.3 * number()?.max(0.0), number()?.abs(), number()?.abs());
    let axis = normal.any_orthonormal_vector();
    let mut pair = || Ok([number()?, number()?]);
    let (gradient, rotation) = ([pair()?, pair()?, pair()?], [pair()?, pair()?, pair()?]);
    let (bend, [noise, error], [allowed, shining]) = (pair()?, pair()?, pair()?);
    let (irradiance, edge_fraction) = (within(input)?, within(input)?);
    let mut sectors = || if input.arbitrary()? { input.arbitrary() } else { Ok([u8::MAX; SECTORS]) };
    let (boundary, free): ([u8; SECTORS], [u8; SECTORS]) = (sectors()?, sectors()?);
    let radii = [r1, r1 * (1.0 + longer)];
    Ok(Record {
        position: within(input)?.to_array(),
        normal: normal.to_array(),
        axis: axis.to_array(),
        irradiance: irradiance.to_array(),
        edge_fraction: edge_fraction.to_array(),
        gradient,
        rotation,
        bend,
        radii,
        overlap: 1.0 + overlap,
        reach: radii[1] * (1.0 + overlap),
        noise: noise.abs(),
        error: error.abs(),
        allowed: 1e-3 * allowed.max(0.0),
        shining: shining.abs(),
        boundary,
        free,
        ..Record::default()
    })
}
