//! Hemispheres with known radiance for tests.

use super::StrataTables;
use crate::cache::hemisphere::Hemisphere;
use crate::memory::{Arena, Line};
use crate::sampling::warp::cosine_hemisphere;
use std::vec;
use std::vec::Vec;

/// Radiance, inverse distance and normal of the hit in the centre of each stratum.
pub(in crate::cache) struct Sky {
    n: usize,
    radiance: Vec<[f32; 3]>,
    inverse: Vec<f32>,
    directions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl Sky {
    /// Radiance at infinity.
    pub(in crate::cache) fn new(n: usize, radiance: impl Fn([f32; 3]) -> f32) -> Self {
        Self::with_hits(n, |w| (radiance(w), 0.0, [0.0, 0.0, -1.0]))
    }

    /// Radiance, inverse distance and normal of the hit of a direction.
    pub(in crate::cache) fn with_hits(n: usize, hit: impl Fn([f32; 3]) -> (f32, f32, [f32; 3])) -> Self {
        let centre = |k: usize| (k as f32 + 0.5) / n as f32;
        let directions: Vec<_> =
            (0..n * n).map(|i| cosine_hemisphere([centre(i % n), centre(i / n)]).to_array()).collect();
        let hits: Vec<_> = directions.iter().map(|&w| hit(w)).collect();
        Self {
            n,
            radiance: hits.iter().map(|hit| [hit.0; 3]).collect(),
            inverse: hits.iter().map(|hit| hit.1).collect(),
            normals: hits.iter().map(|hit| hit.2).collect(),
            directions,
        }
    }

    pub(in crate::cache) fn hemisphere(&self) -> Hemisphere<'_> {
        let Self { n, radiance, inverse, directions, normals } = self;
        let hemisphere = Hemisphere::new(*n, radiance, inverse, directions);
        hemisphere.unwrap().with_normals(normals).unwrap()
    }
}

/// Runs `work` with tables for n × n strata.
pub(in crate::cache) fn with_tables<T>(n: usize, degree: usize, work: impl FnOnce(&StrataTables) -> T) -> T {
    let mut lines = vec![Line([0; 64]); StrataTables::footprint(n, degree).bytes() / 64];
    work(&StrataTables::build(n, degree, &mut Arena::over(&mut lines)).unwrap())
}
