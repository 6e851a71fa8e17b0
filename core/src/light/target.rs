//! Balls around what throws caustics, to aim at: a glass that takes a ten-millionth of all directions is missed by every
//! even cut of them. Triangles are parted where they lie far from each other, the largest parts first, so that of a glass
//! and a wall of mirrors in one hall the glass has a ball of its own.

use super::guide::throws;
use crate::geometry::{Bounds, Frame};
use crate::sampling::warp::{concentric_disk, uniform_cone, uniform_sphere};
use crate::scene::{Scene, Triangle};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::PI;
use glam::Vec3;

/// Balls that there may be.
pub(super) const MOST: usize = 32;

/// Parts with so much of the size of the largest are parted with it.
const ALIKE: f32 = 0.5;

/// By so much of its radius, and of the distance that it is seen from, a ball is larger than what is in it: rounding puts
/// no edge outside.
const AROUND: f32 = 1e-3;
const BLUR: f32 = 5e-7;

/// Triangles that tell where to part, about.
const ASKED: usize = 1 << 16;

/// A ball around things that throw caustics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Target {
    center: [f32; 3],
    /// Negative where there is nothing.
    radius: f32,
}

impl Target {
    pub(super) const NONE: Self = Self { center: [0.0; 3], radius: -1.0 };

    pub(super) fn is_any(&self) -> bool {
        self.radius >= 0.0
    }

    pub(super) fn center(&self) -> Vec3 {
        self.center.into()
    }

    /// The square of its radius, as it is seen from a distance of which this is the square.
    fn seen(&self, squared: f32) -> f32 {
        self.radius * self.radius + BLUR * BLUR * squared
    }

    /// Whether any of it lies before the plane through `on`.
    pub(super) fn is_before(&self, on: Vec3, normal: Vec3) -> bool {
        let to = self.center() - on;
        to.dot(normal) + libm::sqrtf(self.seen(to.length_squared())) > 0.0
    }

    /// The radius for light that comes from nowhere in particular, to a scene of `size`.
    pub(super) fn radius(&self, size: f32) -> f32 {
        libm::sqrtf(self.seen(size * size))
    }

    /// Of the cone that it fills as seen from `from`, one less the cosine; 2, which is every direction, from within.
    pub(super) fn one_minus_cos(&self, from: Vec3) -> f32 {
        let squared = self.center().distance_squared(from);
        let share = self.seen(squared) / squared;
        if share < 1.0 { share / (1.0 + libm::sqrtf(1.0 - share)) } else { 2.0 }
    }

    /// A direction to it from `from`, all alike.
    pub(super) fn towards(&self, from: Vec3, u: [f32; 2]) -> Vec3 {
        let open = self.one_minus_cos(from);
        match (self.center() - from).try_normalize() {
            Some(axis) if open < 2.0 => Frame::from_normal(axis).to_world(uniform_cone(u, open)),
            _ => uniform_sphere(u),
        }
    }

    /// A point that light along `way` comes through to it, all of the disc that it shows alike.
    pub(super) fn across(&self, way: Vec3, size: f32, u: [f32; 2]) -> Vec3 {
        let disk = concentric_disk(u) * self.radius(size);
        self.center() + Frame::from_normal(way).to_world(disk.extend(0.0))
    }

    /// 1 / the solid angle that it fills, if unit `way` from `from` leads to it; otherwise zero.
    #[inline]
    pub(super) fn per_angle(&self, from: Vec3, way: Vec3) -> f32 {
        let to = self.center() - from;
        let squared = to.length_squared();
        let radius = self.seen(squared);
        let misses = to.dot(way) <= 0.0 || to.cross(way).length_squared() > radius;
        if radius >= squared {
            return 0.25 / PI;
        }
        if misses {
            return 0.0;
        }
        let share = radius / squared;
        (1.0 + libm::sqrtf(1.0 - share)) / (2.0 * PI * share)
    }

    /// 1 / the area of its disc, if the line along unit `way` through `on` meets it; otherwise zero.
    #[inline]
    pub(super) fn per_area(&self, on: Vec3, way: Vec3, size: f32) -> f32 {
        let radius = self.seen(size * size);
        if (self.center() - on).cross(way).length_squared() > radius { 0.0 } else { 1.0 / (PI * radius) }
    }
}

/// Triangles that lie together.
#[derive(Clone, Copy)]
struct Part {
    bounds: Bounds,
    middles: Bounds,
    /// Along which axis and where it was parted, and the first of its two halves.
    halves: Option<(usize, f32, usize)>,
}

impl Part {
    const EMPTY: Self = Self { bounds: Bounds::EMPTY, middles: Bounds::EMPTY, halves: None };

    fn size(&self) -> f32 {
        self.bounds.diagonal()
    }

    /// Where it would be parted: the axis along which it is longest, in the middle.
    fn middle(&self) -> Option<(usize, f32)> {
        let extent = self.middles.extent();
        let axis = extent.max_position();
        let (least, middle) = (self.middles.min[axis], self.middles.center()[axis]);
        (extent[axis] > 0.0 && middle > least).then_some((axis, middle))
    }
}

/// Fills `targets` with balls around all that throws caustics, and the rest with [`Target::NONE`].
pub(super) fn fit(scene: &Scene, targets: &mut [Target]) {
    targets.fill(Target::NONE);
    let most = targets.len().min(MOST);
    let every = |step: usize| {
        let throwing = |(_, triangle): &(usize, &Triangle)| {
            scene.materials.get(triangle.material as usize).is_some_and(throws)
        };
        let corners = |(index, _)| scene.mesh.corners(index as u32);
        let finite = |corners: &[Vec3; 3]| corners.iter().all(|corner| corner.is_finite());
        let triangles = scene.mesh.triangles.iter().enumerate().step_by(step);
        triangles.filter(throwing).map(corners).filter(finite)
    };
    let all = || every(1);
    let count = all().count();
    if count == 0 || most == 0 {
        return;
    }
    let step = count / ASKED + 1;
    let mut parts = [Part::EMPTY; 2 * MOST];
    let mut used = 1;
    let part_of = |parts: &[Part], corners: &[Vec3; 3]| {
        let middle = middle(corners);
        let mut part = 0;
        while let Some((axis, at, halves)) = parts[part].halves {
            part = halves + usize::from(middle[axis] >= at);
        }
        part
    };
    loop {
        for corners in every(step) {
            let part = &mut parts[part_of(&parts, &corners)];
            part.middles = part.middles.including(middle(&corners));
            part.bounds = part.bounds.union(Bounds::around(corners));
        }
        let may_part = |part: &Part| part.halves.is_none() && part.middle().is_some();
        let largest = parts[..used].iter().filter(|part| may_part(part)).map(Part::size).fold(0.0, f32::max);
        let before = used;
        for part in &mut parts[..before] {
            // Each has two halves in place of itself.
            let leaves = used.div_ceil(2);
            if leaves < most && may_part(part) && part.size() >= ALIKE * largest {
                part.halves = part.middle().map(|(axis, at)| (axis, at, used));
                used += 2;
            }
        }
        if used == before {
            break;
        }
        parts[before..used].fill(Part::EMPTY);
    }
    for corners in all() {
        let part = &mut parts[part_of(&parts, &corners)];
        part.bounds = part.bounds.union(Bounds::around(corners));
    }
    let mut radii = [0.0f32; 2 * MOST];
    for corners in all() {
        let part = part_of(&parts, &corners);
        let center = parts[part].bounds.center();
        radii[part] = corners.iter().map(|corner| corner.distance(center)).fold(radii[part], f32::max);
    }
    let leaves =
        parts[..used].iter().zip(radii).filter(|(part, _)| part.halves.is_none() && !part.bounds.is_empty());
    for (target, (part, radius)) in targets.iter_mut().zip(leaves) {
        let center = part.bounds.center();
        let blur = 4.0 * f32::EPSILON * center.abs().max_element();
        *target = Target { center: center.into(), radius: radius * (1.0 + AROUND) + blur };
    }
}

fn middle(corners: &[Vec3; 3]) -> Vec3 {
    let [a, b, c] = *corners;
    (a + b + c) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Material, Mesh, Surface, Triangle};
    use std::vec::Vec;

    /// Balls around throwing triangles with such corners.
    fn fitted(corners: &[[Vec3; 3]]) -> Vec<Target> {
        let positions: Vec<_> = corners.iter().flatten().map(Vec3::to_array).collect();
        let triangle = |i: u32| Triangle { vertices: [3 * i, 3 * i + 1, 3 * i + 2], material: 0 };
        let triangles: Vec<_> = (0..corners.len() as u32).map(triangle).collect();
        let mirror = Surface::Mirror { reflectance: crate::Rgb::ONE.into() };
        let materials = [Material { surface: mirror, ..Material::GREY }];
        let mut targets = [Target::default(); MOST];
        fit(
            &Scene {
                mesh: Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() },
                materials: &materials,
                textures: &[],
                lights: &[],
                environment: None,
                camera: Camera::look_at(Vec3::ZERO, Vec3::Z, Vec3::Y, 40.0),
            },
            &mut targets,
        );
        targets.into_iter().filter(Target::is_any).collect()
    }

    fn small(at: Vec3, size: f32) -> [Vec3; 3] {
        [at, at + size * Vec3::X, at + size * Vec3::Y]
    }

    #[test]
    fn balls_hold_everything_and_what_is_small_has_its_own() {
        let wall =
            (0..400).map(|i| small(Vec3::new(100.0 * (i % 20) as f32, 100.0 * (i / 20) as f32, 0.0), 90.0));
        let glass = (0..50).map(|i| small(Vec3::new(700.0, 800.0, 900.0 + 0.001 * i as f32), 0.05));
        let all: Vec<_> = wall.chain(glass).collect();
        let targets = fitted(&all);
        assert_eq!(targets.len(), MOST);
        for corners in &all {
            let holds =
                |target: &Target| corners.iter().all(|c| c.distance(target.center()) <= target.radius);
            assert!(targets.iter().any(holds), "{corners:?}");
        }
        assert!(targets.iter().any(|target| target.radius < 0.1));
    }

    #[test]
    fn what_cannot_be_parted_is_one() {
        assert!(fitted(&[]).is_empty());
        assert_eq!(fitted(&[small(Vec3::ONE, 1.0); 5]).len(), 1);
        assert_eq!(fitted(&[small(Vec3::NAN, 1.0)]).len(), 0);
        // As many as are apart.
        let apart = [0.0, 1.0, 2.0].map(|x| small(1000.0 * Vec3::splat(x), 1.0));
        assert_eq!(fitted(&apart).len(), 3);
    }

    #[test]
    fn directions_and_lines_that_are_aimed_meet_the_ball_and_are_as_dense_as_said() {
        let targets = [
            Target { center: [0.0; 3], radius: 0.15 },
            Target { center: [3.0, 0.0, 0.0], radius: 2.0 },
            Target { center: [5.0, 1.0, 2.0], radius: 9.0 },
        ];
        for target in targets {
            for from in [Vec3::new(0.0, 17_000.0, 3.0), Vec3::new(4.0, 3.0, 2.0), Vec3::new(-0.4, 0.2, 0.1)] {
                let angle = 2.0 * PI * target.one_minus_cos(from);
                for i in 0..64 {
                    // Rounding decides at the rim.
                    let u = [i % 8, i / 8].map(|i| (i as f32 + 0.5) / 8.0);
                    let way = target.towards(from, u);
                    let density = target.per_angle(from, way);
                    assert!(
                        (density * angle - 1.0).abs() < 1e-4,
                        "{target:?} {from} {way} {density} {angle}"
                    );
                    let on = target.across(way, 100.0, u) + 3.0 * way;
                    assert!(target.per_area(on, way, 100.0) > 0.0);
                }
            }
        }
    }
}
