//! Estimated and true derivatives in rooms with known irradiance.

use super::*;
use crate::Level;
use crate::cache::irradiance::metric::{Metric, Settings};
use crate::cache::irradiance::validity;
use crate::cache::skies::{LIGHT, OPEN, SHADOW, Sky, WALLS, with_cells};
use core::hint::black_box;
use glam::{DVec2, DVec3};
use halflight_test_support::{Random, Room};
use std::println;
use std::time::Instant;

fn five(found: &Derivatives) -> [f64; 5] {
    let (g, h) = (found.gradient[1], found.hessian);
    [g.x, g.y, h.xx, h.xy, h.yy].map(f64::from)
}

const RECEIVERS: usize = 40;

/// Root mean square errors of gradient and Hessian over receivers on the floor, relative to the root mean
/// square of the truth, for each estimator.
fn errors<const M: usize>(
    room: &Room,
    n: usize,
    estimate: impl Fn(&CellFlux, &Hemisphere) -> [[f64; 5]; M],
) -> [[f64; 2]; M] {
    let mut random = Random(17);
    let (mut off, mut size) = ([[0.0; 2]; M], [0.0; 2]);
    with_cells(n, |tables| {
        for _ in 0..RECEIVERS {
            let at = DVec2::new(random.between(0.1, 0.9), random.between(0.1, 0.9));
            let truth = room.derivatives(at);
            let gather = Sky::of_room(n, &mut random, room, at);
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

/// Four estimators of gradient and Hessian, and the one without occlusion.
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

/// Room, strata along a side, and maximum errors of gradient and Hessian for the closed mesh and for strata
/// borders: a third above measured values.
type Expected = (&'static str, Room, usize, [[f64; 2]; 2]);

const EXPECTED: [Expected; 8] = [
    ("shadow", SHADOW, 16, [[0.76, 0.69], [0.22, 0.28]]),
    ("shadow", SHADOW, 64, [[0.20, 0.16], [0.04, 0.055]]),
    // The Hessian lacks a term of the background that changes behind the square (removed.md).
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
        // Strata borders are never worse than Ward and Heckbert's gradients, and the open mesh is never as
        // good.
        assert!(cells[0] < 1.05 * ward[0] && cells[0] < paper[0], "{name} {n}: {cells:?} {ward:?} {paper:?}");
        assert!(cells[1] < 0.5 * paper[1], "{name} {n}: {cells:?} {paper:?}");
        if room.square.is_some() {
            // Without occlusion the estimate does not converge to the truth.
            assert!(blind[0] > 0.1 && (n == 16 || blind[1] > 0.3), "{name} {n}: {blind:?}");
        } else if n == 64 {
            assert!(blind[0] < 0.09 && blind[1] < 0.08, "{name} {n}: {blind:?}");
        }
    }
}

/// A room of one radiance has zero derivatives in all estimators except the open mesh, which reports its own
/// error.
#[test]
fn one_radiance_is_flat_but_to_the_open_mesh() {
    let room = Room { square: None, ..SHADOW };
    let n = 16;
    let gather = Sky::of_room(n, &mut Random(5), &room, DVec2::new(0.3, 0.2));
    let hemisphere = gather.hemisphere();
    assert_eq!(five(&closed_mesh(Level::detect(), &hemisphere)), [0.0; 5]);
    assert_eq!(five(&ward_heckbert(&hemisphere)), [0.0; 5]);
    let open = triangulated(Level::detect(), &hemisphere);
    let Hessian { xx, xy, yy } = open.open_hessian;
    assert!(xx.abs() + xy.abs() + yy.abs() > 1.0, "{open:?}");
    for (found, rim) in [open.hessian.xx, open.hessian.xy, open.hessian.yy].iter().zip([xx, xy, yy]) {
        assert!((found - rim).abs() < 1e-5 * xx.abs().max(yy.abs()), "{open:?}");
    }
    // Without occlusion the derivatives are zero up to noise; the sum of magnitudes is not.
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
    with_cells(n, |tables| {
        for _ in 0..20 {
            let at = DVec2::new(random.between(0.2, 0.8), random.between(0.2, 0.8));
            let gather = Sky::of_room(n, &mut random, &WALLS, at);
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
                    let n = if axis == 0 { DVec3::new(sin, 0.0, cos) } else { DVec3::new(0.0, sin, cos) };
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
    // A third above measured values.
    assert!(cells < 0.007 && closed < 0.15 && samples < 0.06, "{cells} {closed} {samples}");
}

/// Prints microseconds per estimator on this machine, without tables; to be run in release.
#[test]
#[ignore = "prints times"]
fn print_times() {
    for n in [16, 32, 64] {
        let gather = Sky::of_room(n, &mut Random(2), &WALLS, DVec2::new(0.3, 0.4));
        let hemisphere = gather.hemisphere();
        let settings = Settings::new(Metric::Halflight, 1.0);
        with_cells(n, |tables| {
            for level in Level::detect().and_below() {
                let time = |work: &dyn Fn()| {
                    let mut best = f64::INFINITY;
                    for _ in 0..40 {
                        let start = Instant::now();
                        (0..10).for_each(|_| work());
                        best = best.min(1e5 * start.elapsed().as_secs_f64());
                    }
                    best
                };
                let borders = time(&|| {
                    let found = black_box(tables).derivatives(level, black_box(&hemisphere)).unwrap();
                    black_box(validity(&settings, &found));
                });
                let mesh = time(&|| {
                    black_box(closed_mesh(level, black_box(&hemisphere)));
                });
                println!("{n:3} {:9} borders and radii {borders:6.2}, mesh {mesh:7.2} µs", level.name());
            }
        });
    }
}
