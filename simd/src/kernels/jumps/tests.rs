//! Whole hemispheres by both kernels over edges: all levels give the same bits, and agree with the scalar
//! reference and with sums in f64.

use super::*;
use crate::Level;
use crate::kernels::cells::{Borders, Cells, between};
use crate::kernels::edge::flux;
use crate::kernels::mesh::{AS_FAR, Mesh, Rule};
use core::f64::consts::{FRAC_PI_4, TAU};
use halflight_test_support::Random;
use std::vec::Vec;

/// Largest error of a hemisphere's gradient, rotation or Hessian, relative to its norm.
const TOLERANCE: f64 = 1e-5;
/// Largest difference between orders of summation, relative to the sum of all magnitudes.
const ORDER: f64 = 1e-6;

/// Shirley and Chiu's concentric map, lifted to the hemisphere.
fn concentric([u, v]: [f64; 2]) -> [f64; 3] {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let (r, phi) = match (x.abs() > y.abs(), y == 0.0) {
        (true, _) => (x, FRAC_PI_4 * y / x),
        (false, false) => (y, TAU / 4.0 - FRAC_PI_4 * x / y),
        (false, true) => (0.0, 0.0),
    };
    [r * phi.cos(), r * phi.sin(), ((1.0 - r) * (1.0 + r)).sqrt()]
}

/// Strata of a hemisphere.
struct View {
    n: usize,
    radiance: Vec<[f32; 3]>,
    inverse: Vec<f32>,
    directions: Vec<[f32; 3]>,
    borders: Vec<Borders>,
}

impl View {
    /// A near occluder at 0.02, a wall at 1, a light at 300 and the sky: radiance and distance by direction.
    fn new(n: usize, random: &mut Random) -> Self {
        let (mut radiance, mut inverse, mut directions) = (Vec::new(), Vec::new(), Vec::new());
        for (i, j) in (0..n * n).map(|at| (at / n, at % n)) {
            let at = [j, i].map(|k| (k as f64 + random.unit()) / n as f64);
            let w = concentric(at);
            let (light, distance) = match w {
                [x, y, _] if x > 0.2 && y > 0.1 && x < 0.6 => ([0.1, 0.02, 0.05], 0.02),
                [x, _, z] if x < 0.0 && z < 0.7 => ([0.5, 0.4 + 0.3 * x, 0.3], -1.0 / x.min(-0.05)),
                [x, y, _] if x * x + y * y < 0.04 => ([40.0, 30.0, 20.0], 300.0),
                [_, y, z] => ([1.0 + 0.3 * y, 1.2, 1.0 + z], f64::INFINITY),
            };
            radiance.push(light.map(|l| l as f32));
            inverse.push((1.0 / distance) as f32);
            directions.push(w.map(|x| x as f32));
        }
        // Arbitrary tables, of the size of actual borders.
        let mut borders = std::vec![[[0.0; 16]; 7]; 2 * n * n.div_ceil(16)];
        for (at, table) in borders.iter_mut().enumerate() {
            let (i, first, below) = (at / 2 / n.div_ceil(16), 16 * (at / 2 % n.div_ceil(16)), at % 2 == 1);
            for row in table {
                for (lane, value) in row.iter_mut().enumerate() {
                    let (j, corner) = (first + lane, if below { i } else { first + lane });
                    *value = if j < n && corner + 1 < n { (random.unit() - 0.5) as f32 } else { 0.0 };
                }
            }
        }
        Self { n, radiance, inverse, directions, borders }
    }

    fn cells(&self) -> Cells<'_> {
        let Self { n, radiance, inverse, borders, .. } = self;
        Cells { n: *n, radiance, inverse_distance: inverse, borders }
    }

    fn mesh(&self, rule: Rule) -> Mesh<'_> {
        let Self { n, radiance, inverse, directions, .. } = self;
        Mesh { n: *n, radiance, inverse_distance: inverse, directions, rule }
    }
}

/// Sums in f64, and sums of the magnitudes of all terms: gradient, rotation, Hessian.
#[derive(Default)]
struct Wide {
    sums: [f64; 15],
    magnitudes: [f64; 3],
}

impl Wide {
    fn add(&mut self, jump: [f64; 3], flux: &Flux<f64>) {
        let luminance: f64 = jump.iter().zip(LUMINANCE).map(|(l, w)| l * f64::from(w)).sum();
        let channels = jump.iter().flat_map(|&l| {
            [
                (0, l * flux.gradient[0]),
                (0, l * flux.gradient[1]),
                (1, l * flux.rotation[0]),
                (1, l * flux.rotation[1]),
            ]
        });
        let terms = channels.chain(flux.hessian.iter().map(|h| (2, luminance * h)));
        for (sum, (kind, term)) in self.sums.iter_mut().zip(terms) {
            *sum += term;
            self.magnitudes[kind] += term.abs();
        }
    }

    /// Distance of `found` from these sums and norm of these sums, for gradient, rotation and Hessian.
    fn beside(&self, found: &Sums) -> [(f64, f64); 3] {
        let mut off = [(0.0, 0.0); 3];
        for (found, (wanted, kind)) in list(found).into_iter().zip(self.sums.iter().zip(KINDS)) {
            off[kind].0 += (f64::from(found) - wanted).powi(2);
            off[kind].1 += wanted * wanted;
        }
        off.map(|(error, size)| (error.sqrt(), size.sqrt()))
    }
}

/// Kind of each number of [`list`]: 0 gradient, 1 rotation, 2 Hessian.
const KINDS: [usize; 15] = [0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 2, 2, 2];

fn list(sums: &Sums) -> [f32; 15] {
    let mut list = [0.0; 15];
    for channel in 0..3 {
        list[4 * channel..4 * channel + 2].copy_from_slice(&sums.gradient[channel]);
        list[4 * channel + 2..4 * channel + 4].copy_from_slice(&sums.rotation[channel]);
    }
    list[12..].copy_from_slice(&sums.hessian);
    list
}

/// The mesh in f64, triangle by triangle.
fn mesh_in_f64(view: &View, rule: Rule) -> Wide {
    let (n, mut wide) = (view.n, Wide::default());
    let vertex = |(i, j): (usize, usize)| {
        let at = i * n + j;
        let unit = view.directions[at].map(f64::from);
        (unit, f64::from(view.inverse[at]), view.radiance[at].map(f64::from))
    };
    for (i, j) in (0..n - 1).flat_map(|i| (0..n - 1).map(move |j| (i, j))) {
        let (a, b, c, d) = ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j));
        for places in [[a, b, c], [a, c, d]] {
            let corners = places.map(vertex);
            let farthest = corners.iter().map(|v| v.1).fold(f64::INFINITY, f64::min);
            let limit = if rule == Rule::Farthest { farthest } else { farthest * f64::from(AS_FAR) };
            let far: Vec<_> = corners.iter().filter(|v| v.1 <= limit).collect();
            let far = if rule == Rule::Farthest { &far[..1] } else { &far[..] };
            let light = |k: usize| far.iter().map(|v| v.2[k]).sum::<f64>() / far.len() as f64;
            let light = [light(0), light(1), light(2)];
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                let (p, q) = (places[from], places[to]);
                let rim =
                    (p.0 == q.0 && (p.0 == 0 || p.0 == n - 1)) || (p.1 == q.1 && (p.1 == 0 || p.1 == n - 1));
                if rule == Rule::Farthest || !rim {
                    let (a, b) = (corners[from], corners[to]);
                    wide.add(light, &flux(f64::from, a.0, a.1, b.0, b.1));
                }
            }
        }
    }
    wide
}

/// Borders in f64.
fn cells_in_f64(view: &View) -> Wide {
    let (n, mut wide) = (view.n, Wide::default());
    for (i, j, below) in (0..n * n).flat_map(|at| [(at / n, at % n, 0), (at / n, at % n, 1)]) {
        let (at, next) = (i * n + j, i * n + j + if below == 1 { n } else { 1 });
        if (below == 0 && j + 1 == n) || (below == 1 && i + 1 == n) {
            continue;
        }
        let table = &view.borders[2 * (i * n.div_ceil(16) + j / 16) + below];
        let [gx, gy, rx, ry, xx, xy, yy] = table.map(|row| f64::from(row[j % 16]));
        let u = f64::from(between(|x| x, view.inverse[at], view.inverse[next]));
        let jump =
            core::array::from_fn(|k| f64::from(view.radiance[at][k]) - f64::from(view.radiance[next][k]));
        let hessian = [xx, xy, yy].map(|h| u * u * h);
        wide.add(jump, &Flux { gradient: [u * gx, u * gy], rotation: [rx, ry], hessian });
    }
    wide
}

/// Compares all levels to the bit, and the result with the scalar reference and the sums in f64.
fn check(name: &str, wide: &Wide, reference: &Sums, of: impl Fn(Level) -> Sums) {
    let found = of(Level::BASELINE);
    for level in Level::detect().and_below() {
        assert_eq!(list(&of(level)).map(f32::to_bits), list(&found).map(f32::to_bits), "{level:?} {name}");
    }
    for (k, (error, size)) in wide.beside(&found).into_iter().enumerate() {
        std::println!("{name}, kind {k}: {:.1e}", error / size);
        assert!(error <= TOLERANCE * size, "{name}, kind {k}: {error:e} of {size:e}");
    }
    for (k, (error, _)) in wide.beside(reference).into_iter().enumerate() {
        assert!(error <= ORDER * wide.magnitudes[k], "{name}, kind {k}: reference off by {error:e}");
    }
}

#[test]
fn whole_hemispheres() {
    let mut random = Random(3);
    for n in [8, 16, 17, 32, 64] {
        let view = View::new(n, &mut random);
        let cells = view.cells();
        check(&std::format!("cells {n}"), &cells_in_f64(&view), &cells.reference(), |level| {
            cells.sums(level)
        });
        for rule in [Rule::Farthest, Rule::DepthAware] {
            let mesh = view.mesh(rule);
            let name = std::format!("{rule:?} {n}");
            check(&name, &mesh_in_f64(&view, rule), &mesh.reference(), |level| mesh.sums(level));
        }
    }
}

/// Edges longer than a right angle, missing strata, and nothing at all.
#[test]
fn coarse_and_broken_hemispheres() {
    let mut random = Random(4);
    for n in [1, 2, 3, 5] {
        let view = View::new(n, &mut random);
        for rule in [Rule::Farthest, Rule::DepthAware] {
            let mesh = view.mesh(rule);
            let (found, reference) = (list(&mesh.sums(Level::BASELINE)), list(&mesh.reference()));
            let size = reference.iter().fold(1e-3f32, |size, x| size.max(x.abs()));
            for (found, reference) in found.iter().zip(reference) {
                assert!((found - reference).abs() < 1e-4 * size, "{rule:?} {n}: {found} {reference}");
            }
            for level in Level::detect().and_below() {
                assert_eq!(list(&mesh.sums(level)), found, "{level:?} {rule:?} {n}");
            }
            let nothing = Mesh { directions: &[], ..mesh };
            assert_eq!(nothing.sums(Level::detect()), Sums::default());
        }
        let nothing = Cells { radiance: &[], ..view.cells() };
        assert_eq!(nothing.sums(Level::detect()), Sums::default());
    }
}
