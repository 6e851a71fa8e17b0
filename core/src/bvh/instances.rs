//! Rays that enter and leave instances. The hierarchy has two levels: boxes around instances in world space,
//! and below them the trees of the prototypes in their own spaces, in one array of nodes.
//!
//! A child out of the range of nodes is the entry of an instance. The ray is transformed, with the same `t`,
//! and traverses the tree of the prototype on the same stack, above an item that leads back ([`LEAVE`]). Its
//! best hit is kept aside, so that hits of the prototype compare by their own indices.
//!
//! The cost: a transform for each instance whose box a ray meets, and nothing in scenes without instances,
//! whose children are all in range.

use super::Bvh;
use super::layout::Child;
use super::traversal_ray::{TraversalRay, traceable};
use crate::geometry::{Hit, Ray};
use crate::scene::{Instance, local_ray, placed};
use bytemuck::{Pod, Zeroable};
use core::mem::replace;
use glam::Vec3;
use halflight_simd::Stack;

/// Least child that is an entry: entry `i` is child `ENTRIES + i`. No tree has as many nodes.
const ENTRIES: u32 = 1 << 30;

/// Item that leads back to the world.
const LEAVE: u32 = (1 << 31) - 1;

/// Largest number of entries.
pub(super) const ENTRIES_MAX: usize = (LEAVE - ENTRIES) as usize;

/// Child that is entry `index`.
pub(super) fn entry(index: u32) -> Child {
    Child(ENTRIES + index)
}

/// Instance and the tree of its prototype. The first cache line has the part that traversal reads.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Entry {
    inverse: [[f32; 3]; 3],
    translation: [f32; 3],
    /// Index of the first triangle of the instance.
    first: u32,
    mirrored: u32,
    /// Bits of the [`Child`] at the top of the prototype's tree.
    root: u32,
    padding: u32,
    linear: [[f32; 3]; 3],
    rest: [u32; 7],
}

/// Position of a ray in the hierarchy: its hit outside, and the entry that it is in.
#[derive(Clone, Copy)]
pub(super) struct Outside {
    hit: Hit,
    entry: u32,
}

impl Outside {
    pub(super) const WORLD: Outside = Outside { hit: Hit::NONE, entry: 0 };
}

impl Entry {
    pub(super) fn new(instance: &Instance, root: Child) -> Self {
        let Instance { inverse, translation, first, mirrored, linear, .. } = *instance;
        Self { inverse, translation, first, mirrored, root: root.0, padding: 0, linear, rest: [0; 7] }
    }

    /// Child at the top of the prototype's tree.
    pub(super) fn root(&self) -> Child {
        Child(self.root)
    }

    /// `hit` of the prototype as one of the instance.
    fn hit(&self, hit: Hit) -> Hit {
        let (u, v) = if self.mirrored != 0 { (hit.v, hit.u) } else { (hit.u, hit.v) };
        Hit { u, v, triangle: self.first.wrapping_add(hit.triangle), ..hit }
    }

    /// Corners in world space, in the order of the prototype.
    pub(super) fn corners(&self, local: [[f32; 3]; 3]) -> [Vec3; 3] {
        local.map(|corner| placed(&self.linear, &self.translation, corner))
    }

    /// Box in the space of the prototype around a box in world space.
    pub(super) fn local_box(&self, lo: Vec3, hi: Vec3) -> (Vec3, Vec3) {
        let (center, half) = (0.5 * (lo + hi) - Vec3::from(self.translation), 0.5 * (hi - lo));
        let [x, y, z] = self.inverse.map(Vec3::from);
        let center = center.x * x + center.y * y + center.z * z;
        let half = half.x * x.abs() + half.y * y.abs() + half.z * z.abs();
        // Wider by the rounding of these sums.
        let half = half + 8.0 * f32::EPSILON * (center.abs() + half);
        (center - half, center + half)
    }
}

impl Bvh<'_> {
    /// Entry that a child is.
    pub(super) fn entry_of(&self, child: Child) -> Option<&Entry> {
        self.entries.get(child.0.checked_sub(ENTRIES)? as usize)
    }

    /// Takes the ray of `world` into the instance of a child out of range, or back out of it. The next child
    /// is on the stack, if there is one.
    #[inline(never)]
    pub(super) fn cross(
        &self,
        child: Child,
        world: &Ray,
        (ray, hit): (&mut TraversalRay, &mut Hit),
        outside: &mut Outside,
        stack: &mut Stack,
    ) {
        let (index, t_max) = (ray.index, ray.t_max);
        if child.0 == LEAVE {
            let inside = replace(hit, outside.hit);
            if let Some(entry) = self.entries.get(outside.entry as usize)
                && inside.is_some()
            {
                hit.take(entry.hit(inside));
            }
            *ray = TraversalRay::new(&Ray { t_max, ..*world }, index);
        } else if let Some(entry) = self.entry_of(child) {
            let local = Ray { t_max, ..local_ray(&entry.inverse, &entry.translation, world) };
            if traceable(&local) {
                *outside = Outside { hit: replace(hit, Hit::NONE), entry: child.0 - ENTRIES };
                *ray = TraversalRay::new(&local, index);
                stack.push_if(true, LEAVE, 0.0);
                stack.push_if(true, entry.root, 0.0);
            }
        }
    }
}
