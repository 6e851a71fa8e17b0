//! Overhangs above surface points: shelves, panels, lamps below ceilings, boards behind furniture. Below a
//! close overhang light changes over a distance of its height, and farther points see it edge-on, so that
//! hardly a gather ray hits it. A record therefore stores the height of overhangs above its support, found by
//! a complete BVH query; a point farther from the record than this height permits sends probe rays upwards
//! once.

use crate::bsdf::Features;
use crate::bvh::clearance::BoxVisitor;
use crate::bvh::{Bvh, Coherence};
use crate::cache::irradiance::{OVERHANG_DISTANCE_FACTOR, OVERHANG_RADIUS_FACTOR, Record, SECTORS};
use crate::geometry::{Frame, Hit, Ray};
use crate::scene::{Surface, SurfacePoint};
use crate::transport::cached::gather::GatherPoint;
use crate::transport::path::{LightEstimator, PathIntegrator};
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use glam::{Vec2, Vec3};
use halflight_simd::kernels::shade::BLOCK;

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

/// Parts of the region above a record that are searched one after the other.
const SEARCHES: [f32; 3] = [0.1, 0.4, 1.0];

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
    let Some(material) = mesh.material(hit.triangle) else { return false };
    let [a, b, c] = mesh.corners(hit.triangle);
    let cos = (b - a).cross(c - a).normalize_or_zero().dot(normal);
    let material = context.scene.materials.get(material as usize);
    cos.abs() > MIN_OVERHANG_COSINE
        && material.is_some_and(|material| {
            !matches!(material.surface, Surface::Dielectric { .. }) && !material.has_cutout()
        })
}

impl<F: Features, E: LightEstimator<F>> PathIntegrator<'_, F, E> {
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
        let axes = [first, second, normal];
        let mut search = Search { record: *record, middle, axes, flat, reach, least, bounds: [middle; 2] };
        search.run(&self.context.bvh, center, half);
        *record = search.record;
    }
}

/// Search for overhangs above the support of a record.
struct Search {
    /// The record, with the overhangs that were found.
    record: Record,
    middle: Vec3,
    /// Axes of the record and the normal of the surface.
    axes: [Vec3; 3],
    /// Height up to which triangles belong to the surface.
    flat: f32,
    reach: f32,
    /// Distance up to which overhangs do not matter.
    least: f32,
    /// Least and greatest corner of the box that is searched.
    bounds: [Vec3; 2],
}

impl Search {
    /// Searches the box around `center` with edges of twice `half`.
    fn run(&mut self, bvh: &Bvh, center: Vec3, half: Vec3) {
        // Close overhangs come first: many others do not matter then.
        let is_whole = SEARCHES.into_iter().all(|part| {
            self.bounds = [center - part * half, center + part * half];
            bvh.overlapping(self.bounds[0], self.bounds[1], self)
        });
        if !is_whole {
            self.record.free = [0; SECTORS];
        }
    }

    /// Distance from which on an overhang at `height` may invalidate the record.
    fn exposed(&self, height: f32) -> f32 {
        let exposed = OVERHANG_DISTANCE_FACTOR * height;
        if exposed < self.least { 0.0 } else { exposed }
    }

    /// Lower bound of the distance passed to [`Record::add_overhang`] for a triangle at `from` or farther, at
    /// `height` or higher: the least of max(exposed(h), from − h) over h ≥ `height`.
    fn nearest(&self, from: f32, height: f32) -> f32 {
        let rising = OVERHANG_DISTANCE_FACTOR / (1.0 + OVERHANG_DISTANCE_FACTOR) * from;
        let rising = rising.max(OVERHANG_DISTANCE_FACTOR * height);
        let low = self.least / OVERHANG_DISTANCE_FACTOR;
        // Rounding must not raise the bound.
        0.999 * if height < low { rising.min((from - low).max(0.0)) } else { rising }
    }
}

impl BoxVisitor for Search {
    #[inline]
    fn enters(&self, corners: &impl Fn() -> [Vec3; 2]) -> bool {
        let [lo, hi] = corners();
        let (center, half) = (0.5 * (lo + hi) - self.middle, 0.5 * (hi - lo));
        let center = Vec3::from(self.axes.map(|axis| center.dot(axis)));
        let half = 1.001 * Vec3::from(self.axes.map(|axis| half.dot(axis.abs())));
        let (lo, hi) = (center - half, center + half);
        if hi.z <= 0.5 * self.flat {
            return false;
        }
        let outside = lo.max(-hi).truncate();
        let from = outside.max(Vec2::ZERO).length();
        let share = self.record.share(self.nearest(from, lo.z.max(0.0)));
        let free = &self.record.free;
        // A triangle that reaches beyond the disc may have a plane above all of it.
        let is_beyond = lo.abs().max(hi.abs()).truncate().length() > self.reach;
        if is_beyond || from <= 2.0 * hi.z {
            return free.iter().any(|free| *free > share);
        }
        let [first, last] =
            sectors([lo.truncate(), hi.truncate(), Vec2::new(lo.x, hi.y), Vec2::new(hi.x, lo.y)]);
        (first..=last.min(first + SECTORS as i32 - 1)).any(|sector| {
            free.get(sector.rem_euclid(SECTORS as i32) as usize).is_some_and(|free| *free > share)
        })
    }

    #[inline]
    fn visit(&mut self, corners: [Vec3; 3]) -> bool {
        let [a, b, c] = corners;
        let [lo, hi] = self.bounds;
        if a.max(b).max(c).cmplt(lo).any() || a.min(b).min(c).cmpgt(hi).any() {
            return true;
        }
        let offsets = corners.map(|corner| corner - self.middle);
        let heights = offsets.map(|offset| offset.dot(self.axes[2]));
        // Most triangles near a record belong to the surface itself.
        if heights.iter().all(|height| *height <= self.flat) {
            return true;
        }
        let [first, second, _] = self.axes;
        let local = |i: usize| Vec3::new(offsets[i].dot(first), offsets[i].dot(second), heights[i]);
        if let Some(overhang) = Overhang::of([0, 1, 2].map(local), self.reach, self.flat) {
            let Overhang { sectors, from, height } = overhang;
            self.record.add_overhang(sectors, self.exposed(height).max(from - height));
        }
        true
    }
}

/// First and last sector of a convex figure with these corners, which does not contain the origin; one more
/// on each side, since a tilted probe may hit the adjacent one. Numbers below 0 and above 15 wrap around.
fn sectors<const N: usize>(corners: [Vec2; N]) -> [i32; 2] {
    let sectors = corners.map(Record::sector);
    // No two corners are half a circle apart.
    let half = SECTORS as f32 / 2.0;
    let turn = |to: f32| (to - sectors[0] + 3.0 * half) % (2.0 * half) - half;
    let turns = sectors.map(turn);
    let (low, high) =
        turns.iter().fold((0.0f32, 0.0f32), |(low, high), turn| (low.min(*turn), high.max(*turn)));
    [libm::floorf(sectors[0] + low) as i32 - 1, libm::floorf(sectors[0] + high) as i32 + 1]
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
        let sectors = sectors(flat);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::{Arena, Line};
    use crate::sampling::Random;
    use crate::scene::{Mesh, Triangle};
    use bytemuck::Zeroable;
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn boxes_that_the_search_does_not_enter_hold_no_overhang_that_matters() {
        let random = Random::new(3, 0);
        let unit = |i: usize| random.single(i as u32);
        let point = |i: usize| Vec3::new(unit(3 * i), unit(3 * i + 1), unit(3 * i + 2)) - 0.5;
        // Small triangles, large ones, and a layer close above the floor.
        let positions: Vec<[f32; 3]> = (0..3000)
            .flat_map(|i| {
                let size = if i % 50 == 0 { 2.0 } else { 0.2 };
                let low = if i % 3 == 0 { 0.05 } else { 1.0 };
                let middle = 10.0 * point(4 * i) * Vec3::new(1.0, 1.0, low);
                [1, 2, 3].map(|k| (middle + size * point(4 * i + k)).to_array())
            })
            .collect();
        let triangles: Vec<Triangle> =
            (0..3000).map(|i| Triangle { vertices: [3 * i, 3 * i + 1, 3 * i + 2], material: 0 }).collect();
        let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
        let mut lines = vec![Line([0; 64]); Bvh::footprint(triangles.len()).bytes() / 64];
        let mut arena = Arena::over(&mut lines);
        let bvh = Bvh::build(&mesh, &mut arena).unwrap();
        let mut confined = 0;
        for i in 0..200 {
            let reach = 0.2 + 4.0 * unit(i);
            let (normal, axis) = (Vec3::Z, Vec3::X);
            let record = Record {
                normal: normal.to_array(),
                axis: axis.to_array(),
                reach: 0.7 * reach,
                free: [u8::MAX; SECTORS],
                ..Record::zeroed()
            };
            let middle = 8.0 * point(20_000 + i) * Vec3::new(1.0, 1.0, if i % 2 == 0 { 0.0 } else { 1.0 });
            let axes = [axis, Vec3::Y, normal];
            let (least, flat, bounds) = (0.3 * unit(300 + i), 1e-3 * reach, [middle; 2]);
            let search = || Search { record, middle, axes, flat, reach, least, bounds };
            let (center, half) = (middle + 0.15 * reach * normal, reach * Vec3::new(1.0, 1.0, 0.15));
            let (mut all, mut pruned) = (search(), search());
            all.bounds = [center - half, center + half];
            (0..triangles.len() as u32).for_each(|i| _ = all.visit(mesh.corners(i)));
            pruned.run(&bvh, center, half);
            assert_eq!(all.record.free, pruned.record.free, "{i}");
            confined += u32::from(pruned.record.free.iter().any(|free| *free < u8::MAX));
        }
        assert!((50..200).contains(&confined), "{confined}");
    }
}
