//! Update of the best hit from the tests of a leaf.

use super::Bvh;
use super::layout::Child;
use super::traversal_ray::TraversalRay;
use crate::geometry::{Hit, MISS};
use halflight_simd::Simd;
use halflight_simd::kernels::triangles::{Areas, intersect};

/// Corners of triangle `i` of a leaf of `count` triangles, from its runs of coordinates.
#[inline(always)]
pub(super) fn corners_of(runs: &[f32], count: usize, i: usize) -> [[f32; 3]; 3] {
    let mut corners = [[f32::NAN; 3]; 3];
    let mut at = i;
    for corner in &mut corners {
        for x in corner {
            *x = runs.get(at).copied().unwrap_or(f32::NAN);
            at += count;
        }
    }
    corners
}

/// Updates `best` with the best hit of a leaf: the nearest, and among equals the lowest index. `best` is no
/// hit, or at most at `ray.t_max`.
#[inline(always)]
pub(super) fn take<S: Simd>(
    simd: S,
    bvh: &Bvh,
    ray: &TraversalRay,
    leaf: Child,
    areas: &Areas,
    best: &mut Hit,
) {
    let (first, count) = leaf.triangles();
    let Some(ids) = bvh.triangles.get(first..first + count) else { return };
    let mut lanes = areas.nearest(simd);
    while lanes != 0 {
        let i = lanes.trailing_zeros() as usize & 7;
        lanes &= lanes - 1;
        if let Some(&triangle) = ids.get(i) {
            let det = areas.det[i];
            best.take(Hit { t: areas.t[i], u: areas.v[i] / det, v: areas.w[i] / det, triangle });
        }
    }
    if areas.on_edge != 0 {
        take_on_edge(bvh, ray, first, ids, areas.on_edge, best);
    }
}

/// True if the ray meets one of the `on_edge` triangles, on whose edge it lies in f32.
pub(super) fn meets_on_edge(bvh: &Bvh, ray: &TraversalRay, leaf: Child, on_edge: u32) -> bool {
    let (first, count) = leaf.triangles();
    let mut best = Hit::NONE;
    take_on_edge(bvh, ray, first, bvh.triangles.get(first..first + count).unwrap_or(&[]), on_edge, &mut best);
    best.is_some()
}

/// Tests the `on_edge` triangles by the scalar reference.
#[cold]
fn take_on_edge(bvh: &Bvh, ray: &TraversalRay, first: usize, ids: &[u32], mut on_edge: u32, best: &mut Hit) {
    let count = ids.len();
    let runs = bvh.coordinates.get(9 * first..9 * (first + count)).unwrap_or(&[]);
    while on_edge != 0 {
        let i = on_edge.trailing_zeros() as usize & 7;
        on_edge &= on_edge - 1;
        let limit = if best.triangle == MISS { ray.t_max } else { best.t };
        if let Some(&triangle) = ids.get(i)
            && let Some((t, u, v)) = intersect(ray.origin, &ray.shear(), limit, corners_of(runs, count, i))
        {
            best.take(Hit { t, u, v, triangle });
        }
    }
}
