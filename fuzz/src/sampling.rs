//! Sample streams, warps and tables: outputs stay in their ranges for any input.

use crate::numbers::{coordinate, fraction};
use arbitrary::{Result, Unstructured};
use halflight_core::memory::{Arena, Line};
use halflight_core::sampling::{AliasTable, Distribution2d, Sampler, warp};

/// Largest deviation of a unit vector's length from 1.
const UNIT_TOLERANCE: f32 = 1e-5;

/// Largest deviation of the sum of probabilities from 1: 64 roundings of f32.
const SUM_TOLERANCE: f32 = 1e-4;

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    let sampler = Sampler::new(input.arbitrary()?, input.arbitrary()?, input.arbitrary()?);
    let dimension = input.arbitrary()?;
    let numbers =
        [sampler.single(dimension)].into_iter().chain(sampler.pair(dimension)).chain(sampler.quad(dimension));
    numbers.for_each(|u| assert!((0.0..1.0).contains(&u), "{u} of {sampler:?} {dimension}"));
    warps([fraction(input)?, fraction(input)?], fraction(input)?);

    let (width, height) = (input.int_in_range(0..=8)?, input.int_in_range(0..=8)?);
    let weights = (0..width * height).map(|_| coordinate(input)).collect::<Result<Vec<f32>>>()?;
    let u = [fraction(input)?, fraction(input)?];
    alias_table(&weights, u[0]);
    distribution(width, height, &weights, u);
    Ok(())
}

fn warps(u: [f32; 2], cone: f32) {
    assert!(warp::concentric_disk(u).length() <= 1.0 + UNIT_TOLERANCE, "disk {u:?}");
    let (b1, b2) = warp::uniform_triangle(u);
    assert!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0 + UNIT_TOLERANCE, "triangle {u:?}: {b1} {b2}");
    for direction in [warp::cosine_hemisphere(u), warp::uniform_sphere(u), warp::uniform_cone(u, cone)] {
        assert!((direction.length() - 1.0).abs() < UNIT_TOLERANCE, "{u:?} {cone}: {direction}");
    }
    assert!(warp::cosine_hemisphere(u).z >= 0.0, "hemisphere {u:?}");
}

fn alias_table(weights: &[f32], u: f32) {
    let mut lines = lines(AliasTable::footprint(weights.len()).bytes());
    let mut arena = Arena::over(&mut lines);
    let table =
        AliasTable::build(weights.len(), |i| weights[i], &mut arena).expect("the footprint was granted");
    let Some((item, pdf, rest)) = table.sample(u) else {
        return assert!(weights.is_empty(), "no item at {u} of {weights:?}");
    };
    assert!(
        item < weights.len() && (0.0..1.0).contains(&rest) && pdf > 0.0,
        "{u} {weights:?}: {item} {pdf} {rest}"
    );
    assert_eq!(pdf, table.pdf(item), "{u} {weights:?}");
    let sum: f32 = (0..weights.len()).map(|i| table.pdf(i)).sum();
    assert!((sum - 1.0).abs() < SUM_TOLERANCE, "probabilities {sum} of {weights:?}");
}

fn distribution(width: usize, height: usize, weights: &[f32], u: [f32; 2]) {
    let mut lines = lines(Distribution2d::footprint(width, height).bytes());
    let mut arena = Arena::over(&mut lines);
    let weight = |x: usize, y: usize| weights[y * width + x];
    let table = Distribution2d::build(width, height, weight, &mut arena).expect("the footprint was granted");
    let Some(cell) = table.sample(u) else {
        return assert!(weights.is_empty(), "no cell at {u:?} of {weights:?}");
    };
    let (x, y) = (cell.x as usize, cell.y as usize);
    let inside = x < width && y < height && cell.offset.iter().all(|o| (0.0..1.0).contains(o));
    assert!(inside && cell.pdf > 0.0, "{u:?} {width}×{height} {weights:?}: {cell:?}");
    assert_eq!(cell.pdf, table.pdf(x, y), "{u:?} {width}×{height} {weights:?}");
}

fn lines(bytes: usize) -> Vec<Line> {
    vec![Line([0; 64]); bytes.div_ceil(64)]
}
