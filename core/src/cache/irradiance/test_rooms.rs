//! Test rooms with exact irradiance on the floor: a unit room of six walls, lit by any of them or by a patch
//! of its ceiling, with or without a square in the air. Irradiance is Lambert's formula over the walls, minus
//! the exactly clipped shadow of the square; derivatives are its central differences in f64.

use super::derivatives::CellFlux;
use crate::cache::hemisphere::Hemisphere;
use crate::memory::{Arena, Line};
use std::vec;
use std::vec::Vec;

type Point = [f64; 3];

fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Convex polygon and its radiance; counter-clockwise as seen from the floor.
struct Emitter {
    corners: Vec<Point>,
    radiance: f64,
}

/// Irradiance at the origin, with normal +z, from a polygon of radiance 1 above it.
fn lambert(corners: &[Point]) -> f64 {
    lambert_of(corners, [0.0, 0.0, 1.0])
}

/// Irradiance at the origin, with normal `n`.
fn lambert_of(corners: &[Point], n: Point) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let edges = corners.iter().zip(next).map(|(&a, &b)| {
        let normal = cross(a, b);
        let sin = dot(normal, normal).sqrt();
        if sin == 0.0 { 0.0 } else { 0.5 * sin.atan2(dot(a, b)) * dot(n, normal) / sin }
    });
    edges.sum()
}

/// Part of a polygon above a plane through the origin (Sutherland, Hodgman).
fn above(polygon: &[Point], plane: Point) -> Vec<Point> {
    let next = polygon.iter().cycle().skip(1);
    let mut clipped = Vec::new();
    for (&p, &q) in polygon.iter().zip(next) {
        let (s, t) = (dot(p, plane), dot(q, plane));
        if s >= 0.0 {
            clipped.push(p);
        }
        if (s < 0.0) != (t < 0.0) {
            let at = s / (s - t);
            clipped.push([0, 1, 2].map(|k: usize| p[k] + at * (q[k] - p[k])));
        }
    }
    clipped
}

/// Part of a polygon seen through `window`.
fn through(polygon: &[Point], window: &[Point]) -> Vec<Point> {
    let next = window.iter().cycle().skip(1);
    window.iter().zip(next).fold(polygon.to_vec(), |polygon, (&a, &b)| above(&polygon, cross(a, b)))
}

/// Unit room, seen from its floor.
#[derive(Clone, Copy)]
pub(super) struct Room {
    /// Radiance of the walls x = 0, x = 1, y = 0, y = 1, and of the ceiling.
    pub(super) walls: [f64; 5],
    /// A square of the ceiling: lowest corner, side, radiance.
    pub(super) patch: Option<([f64; 2], f64, f64)>,
    /// A square in the air, parallel to the floor and rotated: centre, side, radiance. (Aligned with the
    /// walls, its edges would cross theirs all at once, and the irradiance would have kinks.)
    pub(super) square: Option<(Point, f64, f64)>,
}

impl Room {
    fn emitters(&self) -> Vec<Emitter> {
        let [west, east, south, north, ceiling] = self.walls;
        let emitter = |corners: [[i32; 3]; 4], radiance| Emitter {
            corners: corners.map(|c| c.map(f64::from)).to_vec(),
            radiance,
        };
        let mut emitters = vec![
            emitter([[0, 1, 0], [0, 1, 1], [0, 0, 1], [0, 0, 0]], west),
            emitter([[1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]], east),
            emitter([[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]], south),
            emitter([[1, 1, 0], [1, 1, 1], [0, 1, 1], [0, 1, 0]], north),
            emitter([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], ceiling),
        ];
        if let Some(([x, y], side, radiance)) = self.patch {
            emitters.push(Emitter { corners: flat([x, y, 1.0], side), radiance: radiance - ceiling });
        }
        // Orients all polygons counter-clockwise as seen from the middle of the floor.
        for emitter in &mut emitters {
            let seen: Vec<Point> = emitter.corners.iter().map(|&p| sub(p, [0.5, 0.5, 0.0])).collect();
            if lambert(&seen) < 0.0 {
                emitter.corners.reverse();
            }
        }
        emitters
    }

    /// Exact irradiance on the floor.
    pub(super) fn irradiance(&self, place: [f64; 2]) -> f64 {
        self.irradiance_of(place, [0.0, 0.0, 1.0])
    }

    /// Exact irradiance of a receiver with normal `n`; the floor is black.
    pub(super) fn irradiance_of(&self, [x, y]: [f64; 2], n: Point) -> f64 {
        let seen = |corners: &[Point]| corners.iter().map(|&p| sub(p, [x, y, 0.0])).collect::<Vec<_>>();
        let lambert = |corners: &[Point]| lambert_of(&above(corners, n), n);
        let square = self.square.map(|(middle, side, radiance)| (seen(&askew(middle, side)), radiance));
        let mut sum = square.as_ref().map_or(0.0, |(corners, radiance)| radiance * lambert(corners));
        for Emitter { corners, radiance } in self.emitters() {
            let corners = seen(&corners);
            let shadow = square.as_ref().map_or(0.0, |(square, _)| lambert(&through(square, &corners)));
            sum += radiance * (lambert(&corners) - shadow);
        }
        sum
    }

    /// Gradient and Hessian: x, y, xx, xy, yy.
    pub(super) fn truth(&self, [x, y]: [f64; 2]) -> [f64; 5] {
        const H: f64 = 1e-3;
        let e = |i: i32, j: i32| self.irradiance([x + f64::from(i) * H, y + f64::from(j) * H]);
        [
            (e(1, 0) - e(-1, 0)) / (2.0 * H),
            (e(0, 1) - e(0, -1)) / (2.0 * H),
            (e(1, 0) - 2.0 * e(0, 0) + e(-1, 0)) / (H * H),
            (e(1, 1) - e(1, -1) - e(-1, 1) + e(-1, -1)) / (4.0 * H * H),
            (e(0, 1) - 2.0 * e(0, 0) + e(0, -1)) / (H * H),
        ]
    }

    /// Radiance, distance and normal of the hit of direction `w` from the floor.
    pub(super) fn trace(&self, [x, y]: [f64; 2], w: Point) -> (f64, f64, Point) {
        let inside = |low: [f64; 2], side: f64, t: f64| {
            let at = [x + t * w[0] - low[0], y + t * w[1] - low[1]];
            at.iter().all(|c| (0.0..side).contains(c))
        };
        if let Some(([a, b, height], side, radiance)) = self.square {
            let t = height / w[2];
            let (u, v) = ([x + t * w[0] - a, y + t * w[1] - b], SKEW.sin_cos());
            let along = [v.1 * u[0] + v.0 * u[1], v.1 * u[1] - v.0 * u[0]];
            if along.iter().all(|c| c.abs() < 0.5 * side) {
                return (radiance, t, [0.0, 0.0, -1.0]);
            }
        }
        let [west, east, south, north, ceiling] = self.walls;
        let along = |x: f64, d: f64, low: f64, high: f64| match d < 0.0 {
            true => (-x / d, low),
            false => ((1.0 - x) / d, high),
        };
        let (tx, ex) = along(x, w[0], west, east);
        let (ty, ey) = along(y, w[1], south, north);
        let tz = 1.0 / w[2];
        if tz <= tx.min(ty) {
            let patch = self.patch.filter(|&(low, side, _)| inside(low, side, tz));
            return (patch.map_or(ceiling, |(_, _, radiance)| radiance), tz, [0.0, 0.0, -1.0]);
        }
        if tx < ty { (ex, tx, [-w[0].signum(), 0.0, 0.0]) } else { (ey, ty, [0.0, -w[1].signum(), 0.0]) }
    }
}

fn flat([x, y, z]: Point, side: f64) -> Vec<Point> {
    vec![[x, y, z], [x + side, y, z], [x + side, y + side, z], [x, y + side, z]]
}

/// Rotation of the square, radians.
const SKEW: f64 = 0.4;

fn askew([x, y, z]: Point, side: f64) -> Vec<Point> {
    let (sin, cos) = SKEW.sin_cos();
    let corners = flat([-0.5 * side, -0.5 * side, 0.0], side).into_iter();
    corners.map(|[a, b, _]| [x + cos * a - sin * b, y + sin * a + cos * b, z]).collect()
}

/// xorshift64*.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Gather results.
pub(super) struct Gather {
    n: usize,
    radiance: Vec<[f32; 3]>,
    inverse: Vec<f32>,
    directions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl Gather {
    pub(super) fn new(n: usize, random: &mut Random, trace: impl Fn(Point) -> (f64, f64, Point)) -> Self {
        let (mut radiance, mut inverse, mut directions, mut normals) = (vec![], vec![], vec![], vec![]);
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let u = [j, i].map(|k| ((k as f64 + random.unit()) / n as f64) as f32);
            let w = crate::sampling::warp::cosine_hemisphere(u).to_array();
            let (light, distance, normal) = trace(w.map(f64::from));
            radiance.push([light as f32; 3]);
            inverse.push((1.0 / distance) as f32);
            directions.push(w);
            normals.push(normal.map(|x| x as f32));
        }
        Self { n, radiance, inverse, directions, normals }
    }

    pub(super) fn hemisphere(&self) -> Hemisphere<'_> {
        let Self { n, radiance, inverse, directions, normals } = self;
        let hemisphere = Hemisphere::new(*n, radiance, inverse, directions);
        hemisphere.unwrap().with_normals(normals).unwrap()
    }
}

pub(super) fn with_tables<T>(n: usize, work: impl FnOnce(&CellFlux) -> T) -> T {
    let mut lines = vec![Line([0; 64]); CellFlux::footprint(n).bytes() / 64];
    work(&CellFlux::build(n, &mut Arena::over(&mut lines)).unwrap())
}

const SQUARE: (Point, f64, f64) = ([0.45, 0.5, 0.4], 0.3, 0.0);

/// Walls of equal radiance, and a black square.
pub(super) const SHADOW: Room = Room { walls: [1.0; 5], patch: None, square: Some(SQUARE) };
/// Walls of different radiance, and a square.
pub(super) const WALLS: Room = Room { walls: [1.0, 0.2, 0.5, 0.8, 0.3], patch: None, square: Some(SQUARE) };
/// The room `WALLS` without the square.
pub(super) const OPEN: Room = Room { square: None, ..WALLS };
/// A small bright patch of the ceiling.
pub(super) const LIGHT: Room = Room { walls: [0.1; 5], patch: Some(([0.6, 0.55], 0.2, 10.0)), square: None };
