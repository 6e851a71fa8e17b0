//! Traversal of the BVH by one ray: nearest hit or any hit.
//!
//! The ray visits the boxes that it meets, near ones first, and skips those beyond the best hit.
//! 1. Eight boxes are tested at once. Those that the ray meets go on the stack without a branch, in an order
//!    that the build has prepared for the octant of the direction. This is nearly the order of distance,
//!    without sorting.
//! 2. Up to eight triangles are tested at once.
//! 3. A new best hit removes all farther boxes from the stack.
//! 4. Among hits at equal distance the lowest triangle index wins, and a box at exactly the best distance is
//!    still entered: the hit does not depend on the order of traversal.

use super::Bvh;
use super::instances::Outside;
use super::layout::Child;
use super::leaf::take;
use super::traversal_ray::{TraversalRay, traceable};
use crate::geometry::{Hit, Ray};
use halflight_simd::kernels::boxes::ROBUST;
use halflight_simd::{Simd, Stack};

/// Traces one ray.
#[inline(always)]
pub(super) fn trace<S: Simd, const ANY: bool>(simd: S, bvh: &Bvh, ray: &Ray) -> Hit {
    let mut best = Hit::NONE;
    if !traceable(ray) {
        return best;
    }
    let (world, mut outside) = (ray, Outside::WORLD);
    let mut ray = TraversalRay::new(ray, 0);
    let (mut slab, mut shear) = (ray.slab8(simd), ray.shear8(simd));
    let mut stack = Stack::new();
    stack.restart(bvh.root.0);
    while let Some(bits) = stack.pop() {
        let child = Child(bits);
        if !child.is_leaf() {
            let Some(node) = bvh.nodes.get(child.0 as usize) else {
                bvh.cross(child, world, (&mut ray, &mut best), &mut outside, &mut stack);
                (slab, shear) = (ray.slab8(simd), ray.shear8(simd));
                continue;
            };
            let (entry, exit) = slab.interval(simd, &node.rows, ray.t_max);
            simd.push8(node.order_of(ray.octant()), entry, exit, &node.rows[6], &mut stack);
        } else {
            let (first, count) = child.triangles();
            let Some(areas) = shear.areas(simd, bvh.coordinates, 9 * first, count, ray.t_max) else { break };
            if areas.hits | areas.on_edge != 0 {
                take(simd, bvh, &ray, child, &areas, &mut best);
                if best.is_some() {
                    if ANY {
                        break;
                    }
                    ray.t_max = best.t;
                    simd.keep(best.t * ROBUST, &mut stack);
                }
            }
        }
    }
    best
}
