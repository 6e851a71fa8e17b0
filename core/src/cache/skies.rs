//! Hemispheres with known radiance for tests.

use super::hemisphere::Hemisphere;
use super::irradiance::CellFlux;
use super::radiance::StrataTables;
use crate::memory::{Arena, Line};
use crate::sampling::warp::cosine_hemisphere;
use glam::{DVec2, DVec3, Vec3};
use halflight_test_support::{CeilingPatch, FloatingSquare, GatherRays, Hit, Random, Room};
use std::vec;

/// Gather rays with their hits.
pub(in crate::cache) struct Sky(GatherRays);

impl Sky {
    /// Radiance at infinity, at the centre of each of n × n strata.
    pub(in crate::cache) fn new(n: usize, radiance: impl Fn([f32; 3]) -> f32) -> Self {
        Self::with_hits(n, |w| (radiance(w), 0.0, [0.0, 0.0, -1.0]))
    }

    /// Radiance, inverse distance and normal of the hit of a direction, at the centre of each stratum.
    pub(in crate::cache) fn with_hits(n: usize, hit: impl Fn([f32; 3]) -> (f32, f32, [f32; 3])) -> Self {
        let hit = |w: Vec3| {
            let (radiance, inverse, normal) = hit(w.to_array());
            Hit { radiance: radiance.into(), inverse: inverse.into(), normal: Vec3::from(normal).as_dvec3() }
        };
        Self(GatherRays::new(n, cosine_hemisphere, || 0.5, hit))
    }

    /// Rays from a point of the floor of `room`, at random in each stratum.
    pub(in crate::cache) fn of_room(n: usize, random: &mut Random, room: &Room, at: DVec2) -> Self {
        let hit = |w: Vec3| room.hit(at, w.as_dvec3());
        Self(GatherRays::new(n, cosine_hemisphere, || random.unit(), hit))
    }

    pub(in crate::cache) fn hemisphere(&self) -> Hemisphere<'_> {
        let GatherRays { strata, radiance, inverse, directions, normals } = &self.0;
        let hemisphere = Hemisphere::new(*strata, radiance, inverse, directions);
        hemisphere.unwrap().with_normals(normals).unwrap()
    }
}

/// Runs `work` with tables of coefficients for n × n strata.
pub(in crate::cache) fn with_strata<T>(n: usize, degree: usize, work: impl FnOnce(&StrataTables) -> T) -> T {
    let mut lines = vec![Line([0; 64]); StrataTables::footprint(n, degree).bytes() / 64];
    work(&StrataTables::build(n, degree, &mut Arena::over(&mut lines)).unwrap())
}

/// Runs `work` with tables of irradiance for n × n strata.
pub(in crate::cache) fn with_cells<T>(n: usize, work: impl FnOnce(&CellFlux) -> T) -> T {
    let mut lines = vec![Line([0; 64]); CellFlux::footprint(n).bytes() / 64];
    work(&CellFlux::build(n, &mut Arena::over(&mut lines)).unwrap())
}

const SQUARE: FloatingSquare = FloatingSquare { centre: DVec3::new(0.45, 0.5, 0.4), side: 0.3 };
const PATCH: CeilingPatch = CeilingPatch { corner: DVec2::new(0.6, 0.55), side: 0.2, radiance: 10.0 };

/// Walls of equal radiance, and a black square.
pub(in crate::cache) const SHADOW: Room =
    Room { walls: [1.0; 5], patch: None, square: Some(SQUARE), is_sky: false };
/// Walls of different radiance, and a square.
pub(in crate::cache) const WALLS: Room = Room { walls: [1.0, 0.2, 0.5, 0.8, 0.3], ..SHADOW };
/// The room `WALLS` without the square.
pub(in crate::cache) const OPEN: Room = Room { square: None, ..WALLS };
/// A small bright patch of the ceiling.
pub(in crate::cache) const LIGHT: Room =
    Room { walls: [0.1; 5], patch: Some(PATCH), square: None, is_sky: false };
