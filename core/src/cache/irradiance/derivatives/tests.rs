//! Estimated derivatives beside the true ones: a unit room of six walls, lit by any of them or by a patch of its
//! ceiling, with or without a square in the air. Irradiance is exact there (Lambert's formula over the walls, of
//! which the square takes away its shadow by exact clipping), and its derivatives are central differences in f64.

use super::*;
use crate::Level;
use crate::memory::{Arena, Line};
use std::vec::Vec;
use std::{println, vec};

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

/// A convex polygon and its radiance; counter-clockwise as the floor sees it.
struct Emitter {
    corners: Vec<Point>,
    radiance: f64,
}

/// Irradiance at the origin of normal +z from a polygon of radiance 1 above it.
fn lambert(corners: &[Point]) -> f64 {
    lambert_of(corners, [0.0, 0.0, 1.0])
}

/// The same for another normal.
fn lambert_of(corners: &[Point], n: Point) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let edges = corners.iter().zip(next).map(|(&a, &b)| {
        let normal = cross(a, b);
        let sin = dot(normal, normal).sqrt();
        if sin == 0.0 { 0.0 } else { 0.5 * sin.atan2(dot(a, b)) * dot(n, normal) / sin }
    });
    edges.sum()
}

/// The part of a polygon above a plane through the eye (Sutherland, Hodgman).
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

/// The part of a polygon that is seen through another.
fn through(polygon: &[Point], window: &[Point]) -> Vec<Point> {
    let next = window.iter().cycle().skip(1);
    window.iter().zip(next).fold(polygon.to_vec(), |polygon, (&a, &b)| above(&polygon, cross(a, b)))
}

/// A unit room, seen from its floor.
#[derive(Clone, Copy)]
struct Room {
    /// Radiance of the walls x = 0, x = 1, y = 0, y = 1, and of the ceiling.
    walls: [f64; 5],
    /// A square of the ceiling: lowest corner, side, radiance.
    patch: Option<([f64; 2], f64, f64)>,
    /// A square in the air, parallel to the floor and askew: middle, side, radiance. (Were it in line with the walls,
    /// its edges would pass before theirs all at once, and the irradiance would have kinks.)
    square: Option<(Point, f64, f64)>,
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
        // Whatever the order above: counter-clockwise from the middle of the floor.
        for emitter in &mut emitters {
            let seen: Vec<Point> = emitter.corners.iter().map(|&p| sub(p, [0.5, 0.5, 0.0])).collect();
            if lambert(&seen) < 0.0 {
                emitter.corners.reverse();
            }
        }
        emitters
    }

    /// Exact irradiance on the floor.
    fn irradiance(&self, place: [f64; 2]) -> f64 {
        self.irradiance_of(place, [0.0, 0.0, 1.0])
    }

    /// The same of a receiver of another normal; the floor is black.
    fn irradiance_of(&self, [x, y]: [f64; 2], n: Point) -> f64 {
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
    fn truth(&self, [x, y]: [f64; 2]) -> [f64; 5] {
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

    /// Radiance, distance and normal of what is seen from the floor.
    fn look(&self, [x, y]: [f64; 2], w: Point) -> (f64, f64, Point) {
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

/// By how much the square is askew, radians.
const SKEW: f64 = 0.4;

fn askew([x, y, z]: Point, side: f64) -> Vec<Point> {
    let (sin, cos) = SKEW.sin_cos();
    let corners = flat([-0.5 * side, -0.5 * side, 0.0], side).into_iter();
    corners.map(|[a, b, _]| [x + cos * a - sin * b, y + sin * a + cos * b, z]).collect()
}

/// xorshift64*.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// What a gather sees.
struct Gather {
    n: usize,
    radiance: Vec<[f32; 3]>,
    inverse: Vec<f32>,
    directions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl Gather {
    fn new(n: usize, random: &mut Random, look: impl Fn(Point) -> (f64, f64, Point)) -> Self {
        let (mut radiance, mut inverse, mut directions, mut normals) = (vec![], vec![], vec![], vec![]);
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let u = [j, i].map(|k| ((k as f64 + random.unit()) / n as f64) as f32);
            let w = crate::sampling::warp::cosine_hemisphere(u).to_array();
            let (light, distance, normal) = look(w.map(f64::from));
            radiance.push([light as f32; 3]);
            inverse.push((1.0 / distance) as f32);
            directions.push(w);
            normals.push(normal.map(|x| x as f32));
        }
        Self { n, radiance, inverse, directions, normals }
    }

    fn hemisphere(&self) -> Hemisphere<'_> {
        let Self { n, radiance, inverse, directions, normals } = self;
        let hemisphere = Hemisphere::new(*n, radiance, inverse, directions);
        hemisphere.unwrap().with_normals(normals).unwrap()
    }
}

fn with_tables<T>(n: usize, work: impl FnOnce(&CellFlux) -> T) -> T {
    let mut lines = vec![Line([0; 64]); CellFlux::footprint(n).bytes() / 64];
    work(&CellFlux::build(n, &mut Arena::new(bytemuck::cast_slice_mut(&mut lines))).unwrap())
}

fn five(found: &Derivatives) -> [f64; 5] {
    let (g, h) = (found.gradient[1], found.hessian);
    [g.x, g.y, h.xx, h.xy, h.yy].map(f64::from)
}

const RECEIVERS: usize = 40;

/// Root mean square of the errors of gradient and Hessian over receivers on the floor, relative to that of the truth,
/// for each estimator.
fn errors<const M: usize>(
    room: &Room,
    n: usize,
    estimate: impl Fn(&CellFlux, &Hemisphere) -> [[f64; 5]; M],
) -> [[f64; 2]; M] {
    let mut random = Random(17);
    let (mut off, mut size) = ([[0.0; 2]; M], [0.0; 2]);
    with_tables(n, |tables| {
        for _ in 0..RECEIVERS {
            let at = [0.1 + 0.8 * random.unit(), 0.1 + 0.8 * random.unit()];
            let truth = room.truth(at);
            let gather = Gather::new(n, &mut random, |w| room.look(at, w));
            let parts =
                |v: [f64; 5]| [v[0] * v[0] + v[1] * v[1], v[2] * v[2] + 2.0 * v[3] * v[3] + v[4] * v[4]];
            for (off, found) in off.iter_mut().zip(estimate(tables, &gather.hemisphere())) {
                let square = parts(core::array::from_fn(|k| found[k] - truth[k]));
                *off = [off[0] + square[0], off[1] + square[1]];
            }
            let square = parts(truth);
            size = [size[0] + square[0], size[1] + square[1]];
        }
    });
    off.map(|off| [(off[0] / size[0]).sqrt(), (off[1] / size[1]).sqrt()])
}

const SQUARE: (Point, f64, f64) = ([0.45, 0.5, 0.4], 0.3, 0.0);

/// One radiance, and a black square.
const SHADOW: Room = Room { walls: [1.0; 5], patch: None, square: Some(SQUARE) };
/// Walls of different radiance, and a square.
const WALLS: Room = Room { walls: [1.0, 0.2, 0.5, 0.8, 0.3], patch: None, square: Some(SQUARE) };
/// Without the square.
const OPEN: Room = Room { square: None, ..WALLS };
/// A small bright patch of the ceiling.
const LIGHT: Room = Room { walls: [0.1; 5], patch: Some(([0.6, 0.55], 0.2, 10.0)), square: None };

/// The four estimators of gradient and Hessian, and the one without occlusion.
fn all(tables: &CellFlux, hemisphere: &Hemisphere) -> [[f64; 5]; 5] {
    let (level, unoccluded) = (Level::detect(), unoccluded(hemisphere).unwrap());
    let (g, h) = (unoccluded.gradient[1], unoccluded.radiometric);
    [
        five(&ward_heckbert(hemisphere)),
        five(&triangulated(level, hemisphere)),
        five(&closed_mesh(level, hemisphere)),
        five(&tables.derivatives(level, hemisphere).unwrap()),
        [g.x, g.y, h.xx, h.xy, h.yy].map(f64::from),
    ]
}

/// Room, strata along a side, and the most that gradient and Hessian of closed mesh and of borders of strata may be
/// off: a third above what was measured.
type Expected = (&'static str, Room, usize, [[f64; 2]; 2]);

const EXPECTED: [Expected; 8] = [
    ("shadow", SHADOW, 16, [[0.76, 0.69], [0.22, 0.28]]),
    ("shadow", SHADOW, 64, [[0.20, 0.16], [0.04, 0.055]]),
    // The Hessian before a background that changes is not to be had from one hemisphere.
    ("walls", WALLS, 16, [[0.3, 1.0], [0.25, 1.0]]),
    ("walls", WALLS, 64, [[0.08, 0.6], [0.06, 0.6]]),
    ("open", OPEN, 16, [[0.2, 0.37], [0.23, 0.4]]),
    ("open", OPEN, 64, [[0.02, 0.045], [0.04, 0.075]]),
    ("light", LIGHT, 16, [[0.6, 0.5], [0.65, 0.53]]),
    ("light", LIGHT, 64, [[0.075, 0.06], [0.085, 0.072]]),
];

#[test]
fn estimates_beside_the_truth() {
    for (name, room, n, expected) in EXPECTED {
        let [ward, paper, closed, cells, blind] = errors(&room, n, all);
        println!("{name:7}{n:3}  {ward:.3?} {paper:.3?} {closed:.3?} {cells:.3?} {blind:.3?}");
        for (found, most) in [closed, cells].as_flattened().iter().zip(expected.as_flattened()) {
            assert!(found < most, "{name} {n}: {found} of {most}");
        }
        // Borders are never worse than Ward and Heckbert's, and the open mesh is never as good.
        assert!(cells[0] < 1.05 * ward[0] && cells[0] < paper[0], "{name} {n}: {cells:?} {ward:?} {paper:?}");
        assert!(cells[1] < 0.5 * paper[1], "{name} {n}: {cells:?} {paper:?}");
        if room.square.is_some() {
            // What does not know of occlusion does not converge to the truth.
            assert!(blind[0] > 0.1 && (n == 16 || blind[1] > 0.3), "{name} {n}: {blind:?}");
        } else if n == 64 {
            assert!(blind[0] < 0.09 && blind[1] < 0.08, "{name} {n}: {blind:?}");
        }
    }
}

/// A room of one radiance: flat to all but the open mesh, which says itself by how much it is not.
#[test]
fn one_radiance_is_flat_but_to_the_open_mesh() {
    let room = Room { square: None, ..SHADOW };
    let (at, n) = ([0.3, 0.2], 16);
    let gather = Gather::new(n, &mut Random(5), |w| room.look(at, w));
    let hemisphere = gather.hemisphere();
    assert_eq!(five(&closed_mesh(Level::detect(), &hemisphere)), [0.0; 5]);
    assert_eq!(five(&ward_heckbert(&hemisphere)), [0.0; 5]);
    let open = triangulated(Level::detect(), &hemisphere);
    let Hessian { xx, xy, yy } = open.open_hessian;
    assert!(xx.abs() + xy.abs() + yy.abs() > 1.0, "{open:?}");
    for (found, rim) in [open.hessian.xx, open.hessian.xy, open.hessian.yy].iter().zip([xx, xy, yy]) {
        assert!((found - rim).abs() < 1e-5 * xx.abs().max(yy.abs()), "{open:?}");
    }
    // Nor is it to what does not know of occlusion, but for its noise; the sum of magnitudes is something else.
    let Unoccluded { radiometric, geometric, .. } = unoccluded(&hemisphere).unwrap();
    assert!(geometric.xx + geometric.yy > 4.0 * (radiometric.xx + radiometric.yy).abs(), "{geometric:?}");
    assert!(geometric.xx * geometric.yy > geometric.xy * geometric.xy, "{geometric:?} is not positive");
}

/// Both rotational gradients against receivers turned by 0.01 radian in a room whose floor is black.
#[test]
fn rotational_gradients_turn_the_receiver() {
    const TURN: f64 = 0.01;
    let (mut random, n) = (Random(23), 64);
    let mut off = [0.0f64; 3];
    let mut size = 0.0;
    with_tables(n, |tables| {
        for _ in 0..20 {
            let at = [0.2 + 0.6 * random.unit(), 0.2 + 0.6 * random.unit()];
            let gather = Gather::new(n, &mut random, |w| WALLS.look(at, w));
            let hemisphere = gather.hemisphere();
            let level = Level::detect();
            let found = [
                tables.derivatives(level, &hemisphere).unwrap().rotation[0],
                closed_mesh(level, &hemisphere).rotation[0],
                ward_heckbert(&hemisphere).rotation[0],
            ];
            for axis in 0..2 {
                let turned = |sign: f64| {
                    let (sin, cos) = (sign * TURN).sin_cos();
                    let n = if axis == 0 { [sin, 0.0, cos] } else { [0.0, sin, cos] };
                    WALLS.irradiance_of(at, n)
                };
                let truth = (turned(1.0) - turned(-1.0)) / (2.0 * TURN);
                // n × x = y, n × y = -x.
                let along = |r: Vec2| f64::from(if axis == 0 { r.y } else { -r.x });
                for (off, found) in off.iter_mut().zip(found) {
                    *off += (along(found) - truth).powi(2);
                }
                size += truth * truth;
            }
        }
    });
    let [cells, closed, samples] = off.map(|off| (off / size).sqrt());
    println!("rotation: {cells:.4} {closed:.4} {samples:.4}");
    // A third above what was measured.
    assert!(cells < 0.007 && closed < 0.15 && samples < 0.06, "{cells} {closed} {samples}");
}
