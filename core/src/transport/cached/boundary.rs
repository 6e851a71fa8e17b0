//! Fences around the records of the irradiance cache: where, in each direction along the surface, a record
//! ceases to know what the surface sees. Behind a wall that is seen by rays along the surface; beneath what
//! hangs low over it, which such rays pass under, and that the strata of the hemisphere have met.

use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::cache::irradiance::{Record, SECTORS};
use crate::geometry::{Frame, Hit, Ray};
use crate::transport::cached::gather::{GatherPoint, HemisphereSamples};
use crate::transport::path::{Estimator, PathIntegrator};
use crate::transport::settings::Counters;
use glam::{Vec2, Vec3};

/// Rays along the surface in a ring, for each sector of a record's fence.
const RAYS_PER_SECTOR: usize = 2;
const RING: usize = SECTORS * RAYS_PER_SECTOR;

/// By how much they rise: low enough for low walls, high enough for the surface's own roundness. Most strata
/// are higher, and those of a second ring are between.
const SLOPE: f32 = 0.05;
const SECOND_SLOPE: f32 = 0.12;

/// What is met lower than so much of its distance along the surface takes so small a part of the hemisphere
/// that neither gradient nor Hessian tell of what is beneath it.
const LOW: f32 = 0.5;

/// A wall is not nearer between two rays along the surface than by so much; what is hangs.
const NEARER: f32 = 0.95;

impl<F: Features, E: Estimator<F>> PathIntegrator<'_, F, E> {
    /// Looks for walls around a record at `place`, and for what hangs over its surroundings in what its
    /// `strata`, which are local to `frame`, have met.
    pub(in crate::transport) fn fence(
        &self,
        record: &mut Record,
        place: &GatherPoint,
        frame: &Frame,
        strata: &HemisphereSamples,
        counters: &mut Counters,
    ) {
        let walls = self.fence_along(record, place, counters);
        for (&direction, &inverse) in strata.directions.iter().zip(&*strata.inverse_distance) {
            let direction = Vec3::from(direction);
            let along = direction.truncate().length();
            // Lower ones would meet the surface's own roundness; the surface itself is met at no distance.
            let hangs = (SLOPE * along..LOW * along).contains(&direction.z) && inverse.is_finite();
            if hangs && along < record.reach * inverse {
                let towards = record.along_axes(frame.to_world(direction));
                hang(record, &walls, towards, along / inverse);
            }
        }
    }

    /// The record of `place`, so many times as wide: it looks farther for walls and for what hangs over it,
    /// and light changes over its support by as much as before.
    pub fn widened(
        &self,
        record: &Record,
        place: &GatherPoint,
        factor: f32,
        counters: &mut Counters,
    ) -> Record {
        let mut wide = record.widened(factor);
        self.fence_along(&mut wide, place, counters);
        self.note_overhangs(&mut wide, place);
        wide
    }

    /// Looks for walls by rays along the surface, and returns how far they are from ray to ray.
    fn fence_along(&self, record: &mut Record, place: &GatherPoint, counters: &mut Counters) -> [f32; RING] {
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
                    record.fence_off(towards, hit.t);
                }
                None => hang(record, &walls, towards, hit.t),
            }
        }
        walls
    }
}

/// The direction of ray `i` of a ring, in sectors.
fn azimuth(i: usize) -> f32 {
    ((i % RING) as f32 + 0.5) / RAYS_PER_SECTOR as f32
}

/// Fences off what is met at `distance` in the direction `towards`, where it is nearer than the walls that
/// the two rays of the first ring beside it have met.
fn hang(record: &mut Record, walls: &[f32; RING], towards: Vec2, distance: f32) {
    let after = (Record::sector(towards) * RAYS_PER_SECTOR as f32 + 0.5) as usize;
    let wall = walls[(after + RING - 1) % RING].min(walls[after % RING]);
    if distance < NEARER * wall {
        record.fence_off(towards, distance);
    }
}
