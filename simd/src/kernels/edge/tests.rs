//! Edges against quadrature of the boundary integrals in f64 and against the textbook's form factors, and
//! every level against the scalar reference. The rows are configurations in which the textbook's formulas
//! fail.

use super::*;
use crate::{Kernel, Lanes, Level, Simd};
use core::f64::consts::PI;
use halflight_test_support::Random;
use std::vec::Vec;

/// Root mean square error of a row's triangles, relative to that of the expected values.
const TOLERANCE: f64 = 1e-5;
/// Angle (radians) below which a triangle's edges cancel so far that the rounding of its directions
/// dominates.
const NARROW: f64 = 0.02;
/// Largest error of triangles narrower than `NARROW`, in units of eps over the angle.
const ROUNDING: f64 = 10.0;
/// Triangles of a row.
const COUNT: usize = 300;

/// A corner: unit direction and inverse distance.
type Corner = ([f32; 3], f32);
type Wide = [f64; 3];

fn dot(a: Wide, b: Wide) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Wide, b: Wide) -> Wide {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: Wide) -> Wide {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

/// Nodes and weights of Gauss-Legendre quadrature on [0, 1], by Newton's method.
fn gauss(n: usize) -> Vec<(f64, f64)> {
    (1..=n)
        .map(|i| {
            let mut x = (PI * (i as f64 - 0.25) / (n as f64 + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..100 {
                let (mut p, mut q) = (1.0, 0.0);
                for k in 1..=n {
                    let k = k as f64;
                    (p, q) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * q) / k, p);
                }
                slope = n as f64 * (x * p - q) / (x * x - 1.0);
                x -= p / slope;
            }
            (0.5 * (x + 1.0), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// The integrals of the module's documentation along one edge.
fn integrated(nodes: &[(f64, f64)], (a, u): Corner, (b, v): Corner) -> Flux<f64> {
    let (a, b, u, v) = (unit(a.map(f64::from)), unit(b.map(f64::from)), f64::from(u), f64::from(v));
    let normal = cross(a, b);
    let sin = dot(normal, normal).sqrt();
    if sin == 0.0 {
        return Flux::default();
    }
    let (angle, nu) = (sin.atan2(dot(a, b)), normal.map(|x| x / sin));
    nodes.iter().fold(Flux::default(), |sum, (at, weight)| {
        let (p, q) = ((angle * (1.0 - at)).sin() / sin, (angle * at).sin() / sin);
        let w: Wide = core::array::from_fn(|i| p * a[i] + q * b[i]);
        // Linear in the direction: the edge is straight in space.
        let (inverse, ds) = (p * u + q * v, weight * angle);
        let (slope, bend) = (w[2] * inverse * ds, 4.0 * w[2] * inverse * inverse * ds);
        let xy = 0.5 * bend * (nu[0] * w[1] + nu[1] * w[0]);
        sum + Flux {
            gradient: [nu[0] * slope, nu[1] * slope],
            rotation: [-0.5 * nu[1] * ds, 0.5 * nu[0] * ds],
            hessian: [bend * nu[0] * w[0], xy, bend * nu[1] * w[1]],
        }
    })
}

fn sum<T: Number>(zero: Flux<T>, corners: &[Corner], edge: impl Fn(Corner, Corner) -> Flux<T>) -> Flux<T> {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).fold(zero, |sum, (&a, &b)| sum + edge(a, b))
}

fn wide(flux: Flux<f32>) -> Flux<f64> {
    let Flux { gradient, rotation, hessian } = flux;
    Flux {
        gradient: gradient.map(f64::from),
        rotation: rotation.map(f64::from),
        hessian: hessian.map(f64::from),
    }
}

/// Squared norms of gradient, rotation and Hessian.
fn squares(flux: &Flux<f64>) -> [f64; 3] {
    let square = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
    [square(&flux.gradient), square(&flux.rotation), square(&flux.hessian)]
}

fn less(a: Flux<f64>, b: &Flux<f64>) -> Flux<f64> {
    Flux {
        gradient: core::array::from_fn(|i| a.gradient[i] - b.gradient[i]),
        rotation: core::array::from_fn(|i| a.rotation[i] - b.rotation[i]),
        hessian: core::array::from_fn(|i| a.hessian[i] - b.hessian[i]),
    }
}

/// Random direction whose cosine with the normal is from `low` to `high`.
fn direction(random: &mut Random, low: f64, high: f64) -> Wide {
    let (z, phi) = (random.between(low, high), random.between(0.0, 2.0 * PI));
    let r = (1.0 - z * z).sqrt();
    [r * phi.cos(), r * phi.sin(), z]
}

/// Counter-clockwise triangle about `angle` wide around a direction, at these distances.
fn triangle(random: &mut Random, centre: Wide, angle: f64, distances: [f64; 3]) -> [Corner; 3] {
    let x = unit(cross(centre, [0.3, 0.5, 0.8]));
    let y = cross(centre, x);
    let turn = random.between(0.0, 2.0 * PI);
    core::array::from_fn(|k| {
        let phi = turn + 2.0 * PI / 3.0 * (k as f64 + random.between(-0.2, 0.2));
        let (s, c) = (0.58 * angle).sin_cos();
        let w: Wide = core::array::from_fn(|i| c * centre[i] + s * (phi.cos() * x[i] + phi.sin() * y[i]));
        corner(unit(w), distances[k])
    })
}

fn corner(direction: Wide, distance: f64) -> Corner {
    (direction.map(|x| x as f32), (1.0 / distance) as f32)
}

/// Name, angle of the triangles, and generator.
type Row = (&'static str, f64, fn(&mut Random) -> [Corner; 3]);

const ROWS: [Row; 11] = [
    ("large", 1.0, |r| {
        let (centre, t) = (direction(r, 0.6, 1.0), [r.between(1.0, 3.0), r.between(1.0, 3.0), 1.0]);
        triangle(r, centre, 1.0, t)
    }),
    ("a stratum of 32 x 32", 0.025, |r| {
        let (centre, t) = (direction(r, 0.3, 1.0), [r.between(1.0, 1.1), r.between(1.0, 1.1), 1.0]);
        triangle(r, centre, 0.025, t)
    }),
    ("1e-3 rad", 1e-3, |r| {
        let centre = direction(r, 0.3, 1.0);
        triangle(r, centre, 1e-3, [2.0; 3])
    }),
    ("an occluder's jump, 1 : 10", 0.05, |r| {
        let centre = direction(r, 0.3, 1.0);
        triangle(r, centre, 0.05, [1.0, 10.0, 9.0])
    }),
    ("an occluder's jump, 1 : 1000", 0.05, |r| {
        let centre = direction(r, 0.3, 1.0);
        triangle(r, centre, 0.05, [0.01, 10.0, 9.0])
    }),
    ("far away", 0.05, |r| {
        let centre = direction(r, 0.3, 1.0);
        triangle(r, centre, 0.05, [1e4, 1.1e4, 1.2e4])
    }),
    ("two misses", 0.05, |r| {
        let centre = direction(r, 0.3, 1.0);
        triangle(r, centre, 0.05, [2.0, f64::INFINITY, f64::INFINITY])
    }),
    ("a nearly radial edge", 1e-4, |r| {
        let centre = direction(r, 0.3, 1.0);
        let [first, second, _] = triangle(r, centre, 1e-4, [1.0, 20.0, 1.0]);
        let [_, _, third] = triangle(r, centre, 0.1, [1.0, 1.0, 5.0]);
        [first, second, third]
    }),
    ("at the horizon, cos 1e-4", 0.05, |r| {
        let phi = r.between(0.0, 2.0 * PI);
        let at = |phi: f64, z: f64| [(1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z];
        [corner(at(phi, 1e-4), 1.0), corner(at(phi + 0.05, 1e-4), 1.2), corner(at(phi + 0.02, 0.05), 2.0)]
    }),
    ("a plane edge-on, 1e-5", 1e-5, |r| {
        let z = r.between(0.3, 0.9);
        let at = |phi: f64, z: f64| [(1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z];
        [corner(at(0.0, z), 1.0), corner(at(0.5, z + 1e-5), 3.0), corner(at(0.2, z + 2e-5), 2.0)]
    }),
    ("a sliver, 1e-4 wide", 1e-4, |r| {
        let z = r.between(0.3, 0.9);
        let at = |phi: f64, z: f64| [(1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z];
        [corner(at(0.0, z), 1.0), corner(at(0.3, z), 1.5), corner(at(0.3, z + 1e-4), 1.4)]
    }),
];

#[test]
fn every_row_is_within_its_error() {
    let (mut random, nodes) = (Random(7), gauss(24));
    for (name, angle, make) in ROWS {
        let allowed = if angle < NARROW { ROUNDING * f64::from(f32::EPSILON) / angle } else { TOLERANCE };
        let (mut errors, mut sizes) = ([0.0; 3], [0.0; 3]);
        for _ in 0..COUNT {
            let corners = make(&mut random);
            let wanted = sum(Flux::default(), &corners, |a, b| integrated(&nodes, a, b));
            let found = sum(Flux::default(), &corners, |a, b| flux_of(a.0, a.1, b.0, b.1));
            for k in 0..3 {
                errors[k] += squares(&less(wide(found), &wanted))[k];
                sizes[k] += squares(&wanted)[k];
            }
        }
        let [g, r, h] = core::array::from_fn(|k| (errors[k] / sizes[k]).sqrt());
        std::println!("{name}: gradient {g:.1e}, rotation {r:.1e}, Hessian {h:.1e} of {allowed:.1e}");
        assert!(g.max(r).max(h) <= allowed, "{name}: {g:e}, {r:e}, {h:e} of {allowed:e}");
    }
}

/// Irradiance of a polygon of radiance 1 above the receiver (Lambert): ½ Σ θ n·(a × b)/s.
fn lambert(corners: &[Wide]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let edges = corners.iter().zip(next).map(|(&a, &b)| {
        let (normal, cos) = (cross(a, b), dot(a, b));
        let sin = dot(normal, normal).sqrt();
        0.5 * sin.atan2(cos) * normal[2] / sin
    });
    edges.sum()
}

#[test]
fn derivatives_are_those_of_lamberts_formula() {
    // A quad in a slanted plane, counter-clockwise from below.
    let quad = [[0.5, -0.2, 1.0], [1.5, 0.1, 1.3], [1.2, 1.4, 2.0], [0.1, 0.9, 1.6]];
    let turned = |tilt: f64| {
        quad.map(|[x, y, z]| {
            // The receiver turns by -tilt about y: its view turns by tilt.
            let (sin, cos) = tilt.sin_cos();
            [x * cos + z * sin, y, z * cos - x * sin]
        })
    };
    let moved = |x: f64, y: f64| lambert(&quad.map(|p| [p[0] - x, p[1] - y, p[2]]));
    // Error of central differences and of the polynomial.
    const TOLERANCE: f64 = 1e-6;
    const STEP: f64 = 1e-3;
    let corners: Vec<(Wide, f64)> = quad.iter().map(|&p| (unit(p), 1.0 / dot(p, p).sqrt())).collect();
    let next = corners.iter().cycle().skip(1);
    let Flux { gradient, rotation, hessian } = corners
        .iter()
        .zip(next)
        .fold(Flux::default(), |sum, (a, b)| sum + flux(f64::from, a.0, a.1, b.0, b.1));
    let (h, e) = (STEP, moved(0.0, 0.0));
    let close = |found: f64, wanted: f64| assert!((found - wanted).abs() < TOLERANCE, "{found} {wanted}");
    close(gradient[0], (moved(h, 0.0) - moved(-h, 0.0)) / (2.0 * h));
    close(gradient[1], (moved(0.0, h) - moved(0.0, -h)) / (2.0 * h));
    close(hessian[0], (moved(h, 0.0) - 2.0 * e + moved(-h, 0.0)) / (h * h));
    close(hessian[2], (moved(0.0, h) - 2.0 * e + moved(0.0, -h)) / (h * h));
    let corners = moved(h, h) - moved(h, -h) - moved(-h, h) + moved(-h, -h);
    close(hessian[1], corners / (4.0 * h * h));
    // n' = n + tilt (-x): n × n' = -tilt y.
    let slope = (lambert(&turned(h)) - lambert(&turned(-h))) / (2.0 * h);
    close(-rotation[1], slope);
}

#[test]
fn long_edges_are_halved() {
    let nodes = gauss(24);
    let mut random = Random(11);
    for _ in 0..1000 {
        let (a, b) = (direction(&mut random, 0.0, 0.3), direction(&mut random, 0.0, 0.3));
        let (a, b) = (corner(a, random.between(0.5, 3.0)), corner(b, random.between(0.5, 3.0)));
        if dot(a.0.map(f64::from), b.0.map(f64::from)) < -0.999 {
            continue;
        }
        let wanted = integrated(&nodes, a, b);
        let off = squares(&less(wide(flux_of(a.0, a.1, b.0, b.1)), &wanted));
        for (off, size) in off.iter().zip(squares(&wanted)) {
            assert!(off.sqrt() <= TOLERANCE * size.sqrt().max(1.0), "{a:?} {b:?}");
        }
    }
    assert_eq!(flux_of([1.0, 0.0, 0.0], 1.0, [-1.0, 0.0, 0.0], 1.0), Flux::default());
}

#[test]
fn the_horizon_adds_nothing() {
    let found = flux_of([1.0, 0.0, 0.0], 1.0, [0.0, 1.0, 0.0], 3.0);
    assert_eq!(found, Flux::default());
}

/// Sixteen edges, one per lane.
struct Sixteen<'a>(&'a [(Corner, Corner); 16]);

impl Kernel for Sixteen<'_> {
    type Out = [[f32; 16]; 7];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Out {
        let lanes =
            |of: &dyn Fn(&(Corner, Corner)) -> f32| simd.load16(&core::array::from_fn(|i| of(&self.0[i])));
        let [a, b] = [0, 1].map(|end: usize| {
            let at = |e: &(Corner, Corner)| if end == 0 { e.0 } else { e.1 };
            ([0, 1, 2].map(|i: usize| lanes(&|e| at(e).0[i])), lanes(&|e| at(e).1))
        });
        let Flux { gradient: [gx, gy], rotation: [rx, ry], hessian: [xx, xy, yy] } =
            flux(|x| simd.splat16(x), a.0, a.1, b.0, b.1);
        [gx, gy, rx, ry, xx, xy, yy].map(|lanes| lanes.to_array())
    }
}

#[test]
fn every_level_agrees_with_the_single_lane_to_the_bit() {
    let mut random = Random(5);
    for (name, _, make) in ROWS {
        let edges: [(Corner, Corner); 16] = core::array::from_fn(|_| {
            let [a, b, _] = make(&mut random);
            (a, b)
        });
        for level in Level::detect().and_below() {
            let found = level.dispatch(Sixteen(&edges));
            for (i, (a, b)) in edges.iter().enumerate() {
                let Flux { gradient: [gx, gy], rotation: [rx, ry], hessian: [xx, xy, yy] } =
                    flux(|x| x, a.0, a.1, b.0, b.1);
                for (row, wanted) in found.iter().zip([gx, gy, rx, ry, xx, xy, yy]) {
                    assert_eq!(row[i].to_bits(), wanted.to_bits(), "{level:?} {name} {a:?} {b:?}");
                }
            }
        }
    }
}
