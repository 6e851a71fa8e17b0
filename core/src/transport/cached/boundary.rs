//! Boundaries of irradiance records: the distance, per direction along the surface, beyond which a record is
//! not valid. Walls are found by rays along the surface; low overhangs, which these rays pass below, by the
//! hits of the gather rays.

use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::cache::irradiance::{Record, SECTORS};
use crate::geometry::{Frame, Hit, Ray};
use crate::transport::cached::gather::{GatherPoint, HemisphereSamples};
use crate::transport::path::{LightEstimator, PathIntegrator};
use crate::transport::settings::Counters;
use glam::{Vec2, Vec3};

/// Rays along the surface per sector of a record, and per ring.
const RAYS_PER_SECTOR: usize = 2;
const RING: usize = SECTORS * RAYS_PER_SECTOR;

/// Slopes of the rays of both rings: low enough for low walls, high enough for the surface's own curvature.
/// Most gather rays are steeper; the second ring fills the gap.
const SLOPE: f32 = 0.05;
const SECOND_SLOPE: f32 = 0.12;

/// Slope below which hits of gather rays cover so little of the hemisphere that gradient and Hessian do not
/// account for the area beneath.
const MAX_SLOPE: f32 = 0.5;

/// A hit below this fraction of the wall distance beside it is an overhang: walls do not come nearer between
/// two rays of a ring.
const WALL_FRACTION: f32 = 0.95;

impl<F: Features, E: LightEstimator<F>> PathIntegrator<'_, F, E> {
    /// Finds walls around a record at `place` by rays, and overhangs around it from the hits of its `strata`,
    /// which are local to `frame`.
    #[inline(never)]
    pub(in crate::transport) fn find_boundary(
        &self,
        record: &mut Record,
        place: &GatherPoint,
        frame: &Frame,
        strata: &HemisphereSamples,
        counters: &mut Counters,
    ) {
        let walls = self.find_walls(record, place, counters);
        for (&direction, &inverse) in strata.directions.iter().zip(&*strata.inverse_distance) {
            let direction = Vec3::from(direction);
            let along = direction.truncate().length();
            // Lower rays may hit the surface's own curvature; the surface itself has distance 0.
            let is_overhang =
                (SLOPE * along..MAX_SLOPE * along).contains(&direction.z) && inverse.is_finite();
            if is_overhang && along < record.reach * inverse {
                let towards = record.along_axes(frame.to_world(direction));
                limit_at_overhang(record, &walls, towards, along / inverse);
            }
        }
    }

    /// The record of `place` with radii, and search for walls, scaled by `factor`; light changes over the
    /// larger support by as much as before. Points beyond the former support look for overhangs themselves.
    pub fn widened(
        &self,
        record: &Record,
        place: &GatherPoint,
        factor: f32,
        counters: &mut Counters,
    ) -> Record {
        let mut wide = record.widened(factor);
        self.find_walls(&mut wide, place, counters);
        wide
    }

    /// Finds walls by rays along the surface and returns the distance per ray.
    fn find_walls(&self, record: &mut Record, place: &GatherPoint, counters: &mut Counters) -> [f32; RING] {
        let origin = place.position() + place.error * Vec3::from(place.geometric_normal);
        let rays: [Ray; 2 * RING] = core::array::from_fn(|i| {
            let along = record.towards(azimuth(i)).1.normalize_or_zero();
            let slope = if i < RING { SLOPE } else { SECOND_SLOPE };
            Ray::segment(origin, along + slope * place.normal(), record.reach)
        });
        let mut hits = [Hit::NONE; 2 * RING];
        counters.rays += rays.len() as u64;
        self.context.nearest_batch(&rays, Coherence::Incoherent, &mut hits);
        for hit in hits.iter_mut().filter(|hit| hit.triangle == place.triangle) {
            *hit = Hit::NONE;
        }
        let mut walls = [f32::INFINITY; RING];
        for (i, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.is_some()) {
            let towards = record.towards(azimuth(i)).0;
            match walls.get_mut(i) {
                Some(wall) => {
                    *wall = hit.t;
                    record.limit_boundary(towards, hit.t);
                }
                None => limit_at_overhang(record, &walls, towards, hit.t),
            }
        }
        walls
    }
}

/// Azimuth of ray `i` of a ring, in sectors.
fn azimuth(i: usize) -> f32 {
    ((i % RING) as f32 + 0.5) / RAYS_PER_SECTOR as f32
}

/// Limits the record at `distance` in the direction `towards`, if that is nearer than the walls hit by the
/// adjacent rays of the first ring.
fn limit_at_overhang(record: &mut Record, walls: &[f32; RING], towards: Vec2, distance: f32) {
    let after = (Record::sector(towards) * RAYS_PER_SECTOR as f32 + 0.5) as usize;
    let wall = walls[(after + RING - 1) % RING].min(walls[after % RING]);
    if distance < WALL_FRACTION * wall {
        record.limit_boundary(towards, distance);
    }
}
