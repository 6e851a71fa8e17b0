//! Integrals of the albedo tables, in f64: Gauss-Legendre quadrature over the cap of visible normals and
//! midpoints around it, independent of the code that renders.

use super::*;
use halflight_simd::kernels::shade::coat_tables::LAST_AMPLITUDE;
use std::prelude::v1::*;
use std::{format, println};

/// Nodes over the height of the cap, and over half a turn around it, because the integrands are symmetric.
const HEIGHTS: usize = 96;
const TURNS: usize = 48;
/// One unit for rounding, one for the quadrature at grazing angles and at the onset of total reflection.
const TOLERANCE: i16 = 2;
/// Least cosine of a node, as in Mitsuba: no table has a node at exactly grazing incidence.
const GRAZING: f64 = 1e-6;

type Row = [i16; COSINES];

/// All tables of `data.rs`.
struct Tables {
    white: [Row; ROUGHNESSES],
    edge: [Row; ROUGHNESSES],
    white_mean: [i16; ROUGHNESSES],
    edge_mean: [i16; ROUGHNESSES],
    transmittance: [[Row; ROUGHNESSES]; AMPLITUDES],
    internal: [[i16; ROUGHNESSES]; AMPLITUDES],
}

impl Tables {
    fn derive() -> Self {
        let nodes = gauss_legendre(HEIGHTS);
        let cosine = |i: usize| (i as f64 / (COSINES - 1) as f64).powi(2);
        let alpha = |j: usize| (j as f64 / (ROUGHNESSES - 1) as f64).powi(2);
        let eta = |k: usize| {
            let r = f64::from(LAST_AMPLITUDE) * k as f64 / (AMPLITUDES - 1) as f64;
            (1.0 + r) / (1.0 - r)
        };
        let fill = |f: &dyn Fn(f64, f64) -> f64| -> [Row; ROUGHNESSES] {
            core::array::from_fn(|j| core::array::from_fn(|i| units(f(cosine(i), alpha(j)))))
        };
        let mean = |f: &dyn Fn(f64, f64) -> f64| -> [i16; ROUGHNESSES] {
            core::array::from_fn(|j| {
                units(nodes.iter().map(|&(x, w)| w * 4.0 * x.powi(3) * f(x * x, alpha(j))).sum())
            })
        };
        let white = |c: f64, a: f64| reflectance(&nodes, c, a, &|_| 1.0) - 1.0;
        let edge = |c: f64, a: f64| reflectance(&nodes, c, a, &|c| (1.0 - c).powi(5)) - (1.0 - c).powi(5);
        let transmitted =
            |eta: f64| move |c: f64, a: f64, nodes: &Nodes| transmittance(nodes, c, a, eta) - smooth(c, eta);
        Self {
            white: fill(&white),
            edge: fill(&edge),
            white_mean: mean(&white),
            edge_mean: mean(&edge),
            transmittance: core::array::from_fn(|k| fill(&|c, a| transmitted(eta(k))(c, a, &nodes))),
            internal: core::array::from_fn(|k| {
                core::array::from_fn(|j| {
                    let smooth: f64 =
                        nodes.iter().map(|&(x, w)| w * 2.0 * x * fresnel(x, 1.0 / eta(k))).sum::<f64>();
                    units(internal(&nodes, alpha(j), eta(k)) - smooth)
                })
            }),
        }
    }
}

type Nodes = [(f64, f64)];

fn units(x: f64) -> i16 {
    (x / f64::from(STEP)).round() as i16
}

fn smooth(c: f64, eta: f64) -> f64 {
    1.0 - fresnel(c.max(GRAZING), eta)
}

/// Exact Fresnel reflectance of a dielectric boundary, by Snell's law.
fn fresnel(c: f64, eta: f64) -> f64 {
    let sin2_t = (1.0 - c * c) / (eta * eta);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let c_t = (1.0 - sin2_t).sqrt();
    let r_s = (c - eta * c_t) / (c + eta * c_t);
    let r_p = (eta * c - c_t) / (eta * c + c_t);
    0.5 * (r_s * r_s + r_p * r_p)
}

/// Smith's Λ.
fn lambda(c: f64, alpha: f64) -> f64 {
    0.5 * ((1.0 + alpha * alpha * (1.0 - c * c) / (c * c)).sqrt() - 1.0)
}

/// Smith's shadowing G1 = 1 / (1 + Λ), independent of masking.
fn shadowing(c: f64, alpha: f64) -> f64 {
    1.0 / (1.0 + lambda(c, alpha))
}

/// Mean of `f(viewer, normal)` over the normals visible from the cosine `c`.
fn over_visible_normals(nodes: &Nodes, c: f64, alpha: f64, f: &dyn Fn([f64; 3], [f64; 3]) -> f64) -> f64 {
    let c = c.max(GRAZING);
    let wo = [(1.0 - c * c).max(0.0).sqrt(), 0.0, c];
    let length = (alpha * alpha * wo[0] * wo[0] + c * c).sqrt();
    let viewer = [alpha * wo[0] / length, c / length];
    let mut sum = 0.0;
    for &(x, w) in nodes {
        let z = x * (1.0 + viewer[1]) - viewer[1];
        let r = (1.0 - z * z).max(0.0).sqrt();
        for turn in 0..TURNS {
            let phi = core::f64::consts::PI * (turn as f64 + 0.5) / TURNS as f64;
            let m = [alpha * (r * phi.cos() + viewer[0]), alpha * r * phi.sin(), (z + viewer[1]).max(0.0)];
            let length = (m[0] * m[0] + m[1] * m[1] + m[2] * m[2]).sqrt();
            sum += w * f(wo, m.map(|x| x / length)) / TURNS as f64;
        }
    }
    sum
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Directional albedo of microfacets with Fresnel term `f`.
fn reflectance(nodes: &Nodes, c: f64, alpha: f64, f: &dyn Fn(f64) -> f64) -> f64 {
    over_visible_normals(nodes, c, alpha, &|wo, m| {
        let c = dot(wo, m);
        let z = 2.0 * c * m[2] - wo[2];
        if z > 0.0 { f(c.min(1.0)) * shadowing(z, alpha) } else { 0.0 }
    })
}

/// Directional transmittance of a boundary of dielectric microfacets.
fn transmittance(nodes: &Nodes, c: f64, alpha: f64, eta: f64) -> f64 {
    over_visible_normals(nodes, c, alpha, &|wo, m| {
        let c = dot(wo, m).min(1.0);
        let z = ((c - (eta * eta - 1.0 + c * c).sqrt()) * m[2] - wo[2]) / eta;
        if z < 0.0 { (1.0 - fresnel(c, eta)) * shadowing(-z, alpha) } else { 0.0 }
    })
}

/// Mean internal reflectance, averaged as in Mitsuba 3: 64 cosines, both ends with full weight. The limit of
/// a smooth coat is exact.
fn internal(nodes: &Nodes, alpha: f64, eta: f64) -> f64 {
    if alpha == 0.0 {
        return nodes.iter().map(|&(x, w)| w * 2.0 * x * fresnel(x, 1.0 / eta)).sum();
    }
    let sum: f64 = (0..64)
        .map(|i| (f64::from(i) / 63.0).max(GRAZING))
        .map(|c| c * reflectance(nodes, c, alpha, &|c| fresnel(c, 1.0 / eta)))
        .sum();
    2.0 * sum / 64.0
}

/// Abscissas and weights on 0 … 1: roots of the Legendre polynomial by Newton's method.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (core::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..50 {
                let (mut p0, mut p1) = (1.0, x);
                for k in 2..=n {
                    (p0, p1) = (p1, ((2 * k - 1) as f64 * x * p1 - (k - 1) as f64 * p0) / k as f64);
                }
                slope = n as f64 * (x * p1 - p0) / (x * x - 1.0);
                x -= p1 / slope;
            }
            (0.5 * (x + 1.0), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[test]
fn the_tables_hold_the_integrals() {
    fn close(name: &str, stored: &[i16], derived: &[i16]) {
        assert_eq!(stored.len(), derived.len(), "{name}");
        for (i, (s, d)) in stored.iter().zip(derived).enumerate() {
            assert!((s - d).abs() <= TOLERANCE, "{name}[{i}]: stored {s}, derived {d}");
        }
    }
    let t = Tables::derive();
    close("WHITE", data::WHITE.as_flattened(), t.white.as_flattened());
    close("EDGE", data::EDGE.as_flattened(), t.edge.as_flattened());
    close("WHITE_MEAN", &data::WHITE_MEAN, &t.white_mean);
    close("EDGE_MEAN", &data::EDGE_MEAN, &t.edge_mean);
    let flat = |t: &[[Row; ROUGHNESSES]; AMPLITUDES]| t.as_flattened().as_flattened().to_vec();
    close("TRANSMITTANCE", &flat(&data::TRANSMITTANCE), &flat(&t.transmittance));
    close("INTERNAL", data::INTERNAL.as_flattened(), t.internal.as_flattened());
}

/// Prints `data.rs`: `cargo test --release -p halflight-core print_the_tables -- --ignored --nocapture`.
#[test]
#[ignore = "prints data.rs"]
fn print_the_tables() {
    let t = Tables::derive();
    let print = |name: &str, meaning: &str, shape: &str, numbers: String| {
        println!("\n/// {meaning}\npub(super) const {name}: {shape} = {numbers};");
    };
    println!("//! Made by `print_the_tables` in `derive.rs`; see the module above for axes and unit.");
    println!("\nuse super::{{AMPLITUDES, COSINES, ROUGHNESSES}};");
    let surface = "[[i16; COSINES]; ROUGHNESSES]";
    print("WHITE", "Albedo where F is 1, minus 1.", surface, format!("{:?}", t.white));
    print("EDGE", "Albedo where F is (1 - c)^5, minus (1 - c)^5.", surface, format!("{:?}", t.edge));
    let line = "[i16; ROUGHNESSES]";
    print("WHITE_MEAN", "Mean of `WHITE`.", line, format!("{:?}", t.white_mean));
    print("EDGE_MEAN", "Mean of `EDGE`.", line, format!("{:?}", t.edge_mean));
    let volume = "[[[i16; COSINES]; ROUGHNESSES]; AMPLITUDES]";
    print(
        "TRANSMITTANCE",
        "From outside, minus that of the smooth coat.",
        volume,
        format!("{:?}", t.transmittance),
    );
    let surface = "[[i16; ROUGHNESSES]; AMPLITUDES]";
    print("INTERNAL", "From inside, minus that of the smooth coat.", surface, format!("{:?}", t.internal));
}
