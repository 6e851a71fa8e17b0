//! The scene as transport sees it: geometry, its hierarchy and the instruction set, and the walk from surface to
//! surface that all subpaths share.

use crate::Level;
use crate::bsdf::Features;
use crate::bvh::Bvh;
use crate::geometry::{Hit, MISS, Ray};
use crate::scene::{Scene, SurfacePoint};
use crate::transport::estimator::{Counters, MAX_CROSSINGS};
use core::marker::PhantomData;
use glam::Vec3;

/// A scene that is ready for rays. `F` has at least the features of the scene ([`crate::census`]).
#[derive(Clone, Copy)]
pub struct SceneContext<'a, F> {
    /// Geometry, materials, camera.
    pub scene: &'a Scene<'a>,
    /// The hierarchy over its triangles.
    pub bvh: &'a Bvh<'a>,
    /// Highest instruction set to use.
    pub level: Level,
    features: PhantomData<F>,
}

/// A ray between two surfaces of a subpath.
#[derive(Clone, Copy, Debug)]
pub(in crate::transport) struct Segment {
    pub(in crate::transport) ray: Ray,
    /// The triangle that the ray starts on, which it cannot meet again; [`MISS`] at the camera.
    pub(in crate::transport) triangle: u32,
    /// Surfaces of the subpath passed by cut-out or coincidence.
    pub(in crate::transport) crossings: u32,
    /// Distance from the last surface that scattered, over that of the ray's direction.
    pub(in crate::transport) length: f32,
}

impl Segment {
    /// The first of a subpath, from the camera or a light.
    pub(in crate::transport) fn first(ray: Ray) -> Self {
        Self { ray, triangle: MISS, crossings: 0, length: 0.0 }
    }

    /// The next, from `point` of the triangle that `hit` tells in a `direction` of the world.
    pub(in crate::transport) fn onward(&self, point: &SurfacePoint, hit: &Hit, direction: Vec3) -> Self {
        Self { ray: point.spawn(direction), triangle: hit.triangle, crossings: self.crossings, length: 0.0 }
    }
}

impl<'a, F: Features> SceneContext<'a, F> {
    /// Scene and hierarchy, for rays by instructions up to `level`.
    pub fn new(scene: &'a Scene<'a>, bvh: &'a Bvh<'a>, level: Level) -> Self {
        Self { scene, bvh, level, features: PhantomData }
    }

    /// Whether a ray that started on triangle `left` passes `point` as if it were not there: by a cut-out, whose
    /// opacity does not exceed `random` (called for surfaces that have one), or by rounding on its own triangle.
    #[inline]
    pub(in crate::transport) fn is_passed(
        &self,
        point: &SurfacePoint,
        hit: &Hit,
        left: u32,
        random: impl FnOnce() -> f32,
    ) -> bool {
        hit.triangle == left
            || F::CUTOUT
                && point.material.has_cutout()
                && random() >= point.material.opacity.at::<F>(self.scene, point.uv)
    }

    /// Follows `segment` to the surface that scatters it; the n-th surface with a cut-out takes `random(n)`.
    /// `None` where it leaves the scene.
    pub(in crate::transport) fn next_surface(
        &self,
        segment: &mut Segment,
        random: impl Fn(u32) -> f32,
        counters: &mut Counters,
    ) -> Option<(Hit, SurfacePoint<'a>)> {
        counters.rays += 1;
        let hit = self.bvh.nearest(self.level, &segment.ray);
        self.surface_from(hit, segment, random, counters)
    }

    /// The same, where the ray of `segment` was traced and met `hit`.
    pub(in crate::transport) fn surface_from(
        &self,
        mut hit: Hit,
        segment: &mut Segment,
        random: impl Fn(u32) -> f32,
        counters: &mut Counters,
    ) -> Option<(Hit, SurfacePoint<'a>)> {
        loop {
            let point = SurfacePoint::at::<F>(self.scene, &segment.ray, &hit).filter(|_| hit.is_some())?;
            let (crossings, length) = (segment.crossings, segment.length + hit.t);
            if !self.is_passed(&point, &hit, segment.triangle, || random(crossings)) {
                segment.length = length;
                return Some((hit, point));
            }
            if crossings >= MAX_CROSSINGS {
                counters.dropped.unfinished += 1;
                return None;
            }
            let onward = segment.onward(&point, &hit, segment.ray.direction.into());
            *segment = Segment { crossings: crossings + 1, length, ..onward };
            counters.rays += 1;
            hit = self.bvh.nearest(self.level, &segment.ray);
        }
    }
}
