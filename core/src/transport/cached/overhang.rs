//! Overhangs above surface points: shelves, panels, lamps below ceilings, boards behind furniture. Below a
//! close overhang light changes over a distance of its height, and farther points see it edge-on, so that
//! hardly a gather ray hits it. A record therefore stores the height of overhangs above its support, found by
//! a complete BVH query; a point farther from the record than this height permits sends probe rays upwards
//! once.

use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::cache::irradiance::{OVERHANG_DISTANCE_FACTOR, OVERHANG_RADIUS_FACTOR, Record, SECTORS};
use crate::geometry::{Frame, Hit, Ray};
use crate::scene::{Surface, SurfacePoint};
use crate::transport::cached::gather::GatherPoint;
use crate::transport::path::{Estimator, PathIntegrator};
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::wavefront::BLOCK;
use glam::{Vec2, Vec3};

/// Maximum distance to records, in diagonals of the scene.
const MAX_DISTANCE: f32 = 0.25;

/// Directions of the upward probes: along the normal, and at 45 degrees to four sides.
const PROBES: usize = 5;
const PROBE_TILTS: [[f32; 2]; PROBES] = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];

/// Minimum cosine of an overhang's normal to the surface normal, 60 degrees; a steeper hit is a wall.
const MIN_OVERHANG_COSINE: f32 = 0.5;

/// Minimum cosine of an overhang's plane to the normal of a record. It is lower than [`MIN_OVERHANG_COSINE`],
/// since the normals of a record and of a query point differ.
const MIN_PLANE_COSINE: f32 = 0.25;

/// Maximum rise of an overhang's plane from the record to its hit, over the height there. A surface that
/// curves upwards, with heights quadratic in the distance, has a ratio of 2.
const MAX_RISE: f32 = 1.8;

/// Height below which a triangle belongs to the surface itself: in error bounds of its points, and as a
/// fraction of the reach.
const FLAT_IN_ERRORS: f32 = 4.0;
const FLAT_IN_REACH: f32 = 2.5e-5;

/// Origin, axis and length of upward probes.
#[derive(Clone, Copy)]
struct Probe {
    origin: Vec3,
    normal: Vec3,
    length: f32,
}

/// Distance up to which records are valid at each of `points`
/// ([`crate::cache::irradiance::QueryPoint::within`]), for records at distances up to `exposed`.
pub(super) fn within<F: Features>(
    context: &SceneContext<F>,
    points: &[Option<&SurfacePoint>; BLOCK],
    exposed: &[f32; BLOCK],
    counters: &mut Counters,
) -> [f32; BLOCK] {
    let mut within = [f32::INFINITY; BLOCK];
    for ((within, point), exposed) in within.iter_mut().zip(points).zip(exposed) {
        if let Some(point) = point.filter(|_| *exposed > 0.0) {
            counters.rays += PROBES as u64;
            let normal = point.geometric_normal;
            let origin = point.position + point.error * normal;
            *within = OVERHANG_DISTANCE_FACTOR
                * overhang_distance(
                    context,
                    &Probe { origin, normal, length: exposed / OVERHANG_DISTANCE_FACTOR },
                );
        }
    }
    within
}

/// Distance to an overhang that occludes light; infinite if it exceeds the length of the probe.
fn overhang_distance<F: Features>(context: &SceneContext<F>, probe: &Probe) -> f32 {
    let frame = Frame::from_normal(probe.normal);
    let rays = PROBE_TILTS.map(|[x, y]| {
        let direction = frame.to_world(Vec3::new(x, y, 1.0)).normalize_or_zero();
        Ray::segment(probe.origin, direction, probe.length)
    });
    let mut hits = [Hit::NONE; PROBES];
    context.nearest_batch(&rays, Coherence::Incoherent, &mut hits);
    let hanging = hits.iter().filter(|hit| is_overhang(context, hit, probe.normal));
    hanging.map(|hit| hit.t).fold(f32::INFINITY, f32::min)
}

/// True if `hit` is an overhang above a surface with this `normal`, and occludes light. Glass and cut-outs do
/// not.
fn is_overhang<F>(context: &SceneContext<F>, hit: &Hit, normal: Vec3) -> bool {
    let mesh = &context.scene.mesh;
    let Some(triangle) = mesh.triangles.get(hit.triangle as usize) else { return false };
    let [a, b, c] = mesh.corners(hit.triangle);
    let cos = (b - a).cross(c - a).normalize_or_zero().dot(normal);
    let material = context.scene.materials.get(triangle.material as usize);
    cos.abs() > MIN_OVERHANG_COSINE
        && material.is_some_and(|material| {
            !matches!(material.surface, Surface::Dielectric { .. }) && !material.has_cutout()
        })
}

impl<F: Features, E: Estimator<F>> PathIntegrator<'_, F, E> {
    /// Measures the height of overhangs above each of `places`, up to the maximum distance to records.
    pub fn measure_overhangs(&self, places: &mut [GatherPoint], counters: &mut Counters) {
        let length = MAX_DISTANCE * self.context.bvh.bounds().diagonal();
        for place in places.iter_mut().filter(|place| place.is_some()) {
            counters.rays += PROBES as u64;
            let normal = Vec3::from(place.geometric_normal);
            let origin = place.position() + place.error * normal;
            let overhang_distance = overhang_distance(&self.context, &Probe { origin, normal, length });
            place.within = (OVERHANG_DISTANCE_FACTOR * overhang_distance).min(f32::MAX);
        }
    }

    /// Stores the overhangs above the support of a record at `place`, and above the place itself.
    pub(in crate::transport) fn add_overhangs(&self, record: &mut Record, place: &GatherPoint) {
        record.confine(place.within);
        let least = OVERHANG_RADIUS_FACTOR * record.least;
        // Higher overhangs do not matter; a tilted probe may hit one outside by as much as this height.
        let height = record.reach.max(least) / OVERHANG_DISTANCE_FACTOR;
        let reach = record.reach + height;
        let (middle, normal) = (place.position(), Vec3::from(place.geometric_normal));
        let along = (Vec3::ONE - normal * normal).max(Vec3::ZERO).to_array().map(libm::sqrtf);
        let half = reach * Vec3::from(along) + 0.5 * height * normal.abs();
        let center = middle + 0.5 * height * normal;
        let [first, second] = record.axes();
        let flat = FLAT_IN_ERRORS * place.error.max(FLAT_IN_REACH * reach);
        let mut noted = *record;
        let (lo, hi) = (center - half, center + half);
        let is_whole = self.context.bvh.overlapping(lo, hi, |corners| {
            let [a, b, c] = corners;
            if a.max(b).max(c).cmplt(lo).any() || a.min(b).min(c).cmpgt(hi).any() {
                return true;
            }
            let offsets = corners.map(|corner| corner - middle);
            let heights = offsets.map(|offset| offset.dot(normal));
            // Most triangles near a record belong to the surface itself.
            if heights.iter().all(|height| *height <= flat) {
                return true;
            }
            let local = |i: usize| Vec3::new(offsets[i].dot(first), offsets[i].dot(second), heights[i]);
            if let Some(overhang) = Overhang::of([0, 1, 2].map(local), reach, flat) {
                let Overhang { sectors, from, height } = overhang;
                let close = if OVERHANG_DISTANCE_FACTOR * height < least {
                    0.0
                } else {
                    OVERHANG_DISTANCE_FACTOR * height
                };
                noted.add_overhang(sectors, close.max(from - height));
            }
            true
        });
        if !is_whole {
            noted.free = [0; SECTORS];
        }
        *record = noted;
    }
}

/// Triangle above a disc.
struct Overhang {
    /// First and last sector of the triangle, beyond 16 around the circle.
    sectors: [i32; 2],
    /// Minimum distance from the centre, and minimum height.
    from: f32,
    height: f32,
}

impl Overhang {
    /// Triangle `corners` above the disc of radius `reach` around the origin in the plane z = 0. Heights up
    /// to `flat` belong to the plane.
    fn of(corners: [Vec3; 3], reach: f32, flat: f32) -> Option<Self> {
        let [a, b, c] = corners;
        let (highest, lowest) = (a.max(b).max(c), a.min(b).min(c));
        let [x, y] = [highest.x.min(-lowest.x), highest.y.min(-lowest.y)];
        if x.min(y) < -reach || highest.z <= flat {
            return None;
        }
        let normal = (b - a).cross(c - a);
        let is_steep = normal.z.abs() <= MIN_PLANE_COSINE * normal.length();
        if is_steep {
            return None;
        }
        // Height of the triangle's plane above the centre, and its slope.
        let (middle, slope) = (normal.dot(a) / normal.z, normal.truncate().length() / normal.z.abs());
        let height = lowest.z.max(middle - reach * slope).max(0.0);
        let bends = middle <= 0.0 && height - middle >= MAX_RISE * height;
        if bends {
            return None;
        }
        let flat = corners.map(Vec3::truncate);
        let from = distance(flat);
        if from <= 2.0 * height {
            return Some(Self { sectors: [0, SECTORS as i32 - 1], from, height });
        }
        // The origin is outside: no two corners are half a circle apart.
        let [first, second, third] = flat.map(Record::sector);
        let half = SECTORS as f32 / 2.0;
        let turn = |to: f32| (to - first + 3.0 * half) % (2.0 * half) - half;
        let (low, high) = (turn(second).min(turn(third)).min(0.0), turn(second).max(turn(third)).max(0.0));
        // A tilted probe hits at most the adjacent sector.
        let sectors = [libm::floorf(first + low) as i32 - 1, libm::floorf(first + high) as i32 + 1];
        Some(Self { sectors, from, height })
    }
}

/// Distance from the origin to a triangle; 0 inside.
fn distance(corners: [Vec2; 3]) -> f32 {
    let [a, b, c] = corners;
    let sides = [(a, b), (b, c), (c, a)];
    let areas = sides.map(|(p, q)| p.perp_dot(q));
    if areas.iter().all(|area| *area >= 0.0) || areas.iter().all(|area| *area <= 0.0) {
        return 0.0;
    }
    let to = |(p, q): (Vec2, Vec2)| {
        let along = q - p;
        let share = (-p.dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (p + share * along).length()
    };
    sides.map(to).into_iter().fold(f32::INFINITY, f32::min)
}
