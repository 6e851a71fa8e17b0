//! Hessians of coefficients by exact edges of polygons, one of which hides others: a reference for borders
//! between strata.
//!
//! An edge moves with the inverse distance u of the near surface, and carries the radiance on both sides
//! along. Behind a silhouette the radiance B belongs to a surface of another inverse distance v, so that the
//! Hessian lacks
//!
//!   ∮ (u - v)² z Z_k Sym(ν ⊗ ∇B) ds,
//!
//! ν the normal of the silhouette. In these rooms B jumps, by ΔB across an edge with the normal ν_B, and is
//! constant elsewhere: a junction, where the edge ends behind the silhouette at the angle χ, adds
//!
//!   (u - v)² z Z_k ΔB Sym(ν ⊗ ν_B)/|sin χ|.

use super::super::polygons::nodes;
use super::*;
use glam::Vec3Swizzles;
use halflight_core::cache::radiance::zernike::{gradients, values};
use halflight_test_support::polygon::{edges, normal};

/// Elements xx, xy, yy of the Hessian of each coefficient.
type Hessians = [[f64; 3]; COUNT_MAX];

/// Adds `factor` Sym(a ⊗ b).
fn add_symmetric(sum: &mut [f64; 3], factor: f64, a: DVec2, b: DVec2) {
    let products = [a.x * b.x, 0.5 * (a.x * b.y + a.y * b.x), a.y * b.y];
    sum.iter_mut().zip(products).for_each(|(sum, product)| *sum += factor * product);
}

/// Inverse distance of the plane of `polygon` along `w`.
fn inverse_distance(polygon: &[DVec3], w: DVec3) -> f64 {
    let normal = normal(polygon);
    normal.dot(w) / normal.dot(polygon[0])
}

/// Values and gradients of all functions along `w`.
fn functions(w: DVec3) -> impl Iterator<Item = (f64, DVec2)> {
    let q = [w.x as f32, w.y as f32];
    let gradients = gradients(DEGREE, q).map(|gradient| DVec2::from(gradient.map(f64::from)));
    values(DEGREE, q).into_iter().map(f64::from).zip(gradients)
}

/// Adds an edge of the surface of `owner`, across which the radiance rises by `jump` to the left.
fn add_edge((a, b): (DVec3, DVec3), owner: &[DVec3], jump: f64, sum: &mut Hessians) {
    for (w, step) in nodes(a, b) {
        let (q, u) = (w.xy(), inverse_distance(owner, w));
        let border = w.z * w.cross(step).xy();
        for (sum, (value, gradient)) in sum.iter_mut().zip(functions(w)) {
            let kernel = 4.0 * value * q - gradient + q * q.dot(gradient);
            add_symmetric(sum, jump * u * u, border, kernel);
        }
    }
}

/// Hessians at a point of the floor by edges, and what the light behind silhouettes adds.
fn hessians(room: &Room, from: DVec2) -> [Hessians; 2] {
    let square = room.occluder(from);
    let mut sums = [[[0.0; 3]; COUNT_MAX]; 2];
    let [by_edges, by_junctions] = &mut sums;
    for (corners, radiance) in &room.polygons(from) {
        edges(corners).for_each(|edge| add_edge(edge, corners, *radiance, by_edges));
        let Some(square) = &square else { continue };
        let is_silhouette = |(a, b): (DVec3, DVec3)| {
            edges(square).any(|(c, d)| {
                let side = c.cross(d).normalize();
                side.dot(a.normalize()).abs().max(side.dot(b.normalize()).abs()) < 1e-9
            })
        };
        let hidden: Vec<_> = edges(&behind(square, corners)).collect();
        for (&edge, &next) in hidden.iter().zip(hidden.iter().cycle().skip(1)) {
            let owner = if is_silhouette(edge) { square } else { corners };
            add_edge(edge, owner, -radiance, by_edges);
            if is_silhouette(edge) == is_silhouette(next) {
                continue;
            }
            let w = next.0.normalize();
            let [first, second] = [edge, next].map(|(a, b)| a.cross(b).normalize());
            let apart = inverse_distance(square, w) - inverse_distance(corners, w);
            let factor = radiance * apart * apart * w.z / first.cross(second).length();
            for (sum, (value, _)) in by_junctions.iter_mut().zip(functions(w)) {
                add_symmetric(sum, factor * value, first.xy(), second.xy());
            }
        }
    }
    sums
}

/// Edges alone are wrong by a fifth and more at many receivers below the square, whatever the number
/// of strata; with junctions they are exact.
#[test]
fn exact_edges_and_junctions_give_the_hessians_of_all_coefficients() {
    /// Step of differences: a junction comes or goes within longer ones.
    const SHORT_STEP: f64 = 1e-4;
    /// Differences of f64 over the step.
    const EXACT: f64 = 2e-3;
    let mut random = Random(17);
    for (name, room) in &ROOMS[1..] {
        let (mut wrong, mut all) = (0, [[Squares::default(); 2]; 4]);
        for _ in 0..RECEIVERS {
            let from = DVec2::new(0.1 + 0.8 * random.unit(), 0.1 + 0.8 * random.unit());
            let truth = derivatives(room, from, SHORT_STEP);
            let [by_edges, by_junctions] = hessians(room, from);
            let mut here = [Squares::default(); 2];
            let functions = by_edges.iter().zip(&by_junctions).zip(&truth).take(count(DEGREE));
            for (k, ((by_edges, by_junctions), truth)) in functions.enumerate() {
                let group =
                    (0..4).find(|group| (count(2 * group) - 2 * group - 1..count(2 * group)).contains(&k));
                for (element, weight) in [1.0, 2.0, 1.0].into_iter().enumerate() {
                    let (found, more) = (by_edges[element], by_junctions[element]);
                    for (with, found) in [found, found + more].into_iter().enumerate() {
                        here[with].add(found, truth[2 + element], weight);
                        if let Some(group) = group {
                            all[group][with].add(found, truth[2 + element], weight);
                        }
                    }
                }
            }
            let [without, with] = here.map(Squares::relative);
            assert!(with < EXACT, "{name} {from}: {without} without, {with} with junctions");
            wrong += usize::from(without >= 0.2);
        }
        let without = all.map(|group| group[0].relative());
        let is_wrong = without.iter().all(|error| *error > 0.3);
        assert!(is_wrong == room.square.is_some(), "{name}: {without:?}");
        assert_eq!(wrong > 0, room.square.is_some(), "{name}");
    }
}
