//! The scene as transport sees it: geometry, hierarchy, lights and instruction set, and the walk from surface
//! to surface that all subpaths share.

use crate::Level;
use crate::bsdf::{Bsdf, Features};
use crate::bvh::{Bvh, Coherence};
use crate::geometry::{Hit, MISS, Ray};
use crate::light::LightSampler;
use crate::scene::{Material, Scene, SurfacePoint};
use crate::transport::settings::Counters;
use crate::transport::walk::termination::MAX_CROSSINGS;
use core::marker::PhantomData;
use glam::Vec3;

/// A scene that is ready for rays. `F` has at least the features of the scene ([`crate::census`]).
#[derive(Clone, Copy)]
pub struct SceneContext<'a, F> {
    /// Geometry, materials, camera.
    pub scene: &'a Scene<'a>,
    /// The hierarchy over its triangles.
    pub bvh: &'a Bvh<'a>,
    /// Its lights.
    pub lights: &'a LightSampler<'a>,
    /// Highest instruction set to use.
    pub level: Level,
    /// Whether a shadow ray may go on behind a hit, as some surfaces let a part of the light through.
    pub(in crate::transport) has_cutouts: bool,
    /// Whether some surfaces may reflect or refract into one direction only.
    pub(in crate::transport) has_mirrors: bool,
    features: PhantomData<F>,
}

/// A ray between two surfaces of a subpath.
#[derive(Clone, Copy, Debug)]
pub(in crate::transport) struct Segment {
    pub(in crate::transport) ray: Ray,
    /// The triangle that the ray starts on, which it cannot meet again; [`MISS`] at the camera.
    pub(in crate::transport) triangle: u32,
    /// Surfaces of the subpath so far, scattered at or passed by cut-out or coincidence.
    pub(in crate::transport) surfaces: u32,
    /// Distance from the last surface that scattered, over that of the ray's direction.
    pub(in crate::transport) length: f32,
}

impl Segment {
    /// The first of a subpath, from the camera or a light.
    pub(in crate::transport) fn first(ray: Ray) -> Self {
        Self { ray, triangle: MISS, surfaces: 0, length: 0.0 }
    }

    /// The next, from `point` of the triangle that `hit` tells in a `direction` of the world.
    pub(in crate::transport) fn onward(&self, point: &SurfacePoint, hit: &Hit, direction: Vec3) -> Self {
        Self { ray: point.spawn(direction), triangle: hit.triangle, surfaces: self.surfaces + 1, length: 0.0 }
    }
}

impl<'a, F: Features> SceneContext<'a, F> {
    /// Scene, hierarchy and lights, for rays by instructions up to `level`.
    pub fn new(scene: &'a Scene<'a>, bvh: &'a Bvh<'a>, lights: &'a LightSampler<'a>, level: Level) -> Self {
        let has_cutouts = F::CUTOUT && scene.materials.iter().any(Material::has_cutout);
        let has_mirrors = scene.materials.iter().any(|material| material.surface.may_be_smooth());
        Self { scene, bvh, lights, level, has_cutouts, has_mirrors, features: PhantomData }
    }

    /// The nearest hit of `ray`.
    #[inline]
    pub(in crate::transport) fn nearest(&self, ray: &Ray) -> Hit {
        self.bvh.nearest(self.level, ray)
    }

    /// The nearest hits of `rays`.
    #[inline]
    pub(in crate::transport) fn nearest_batch(&self, rays: &[Ray], coherence: Coherence, hits: &mut [Hit]) {
        self.bvh.nearest_batch(self.level, rays, coherence, hits);
    }

    /// The surface point that `ray` met by `hit`.
    #[inline]
    pub(in crate::transport) fn surface_at(&self, ray: &Ray, hit: &Hit) -> Option<SurfacePoint<'a>> {
        SurfacePoint::at::<F>(self.scene, ray, hit).filter(|_| hit.is_some())
    }

    /// The BSDF at `point`.
    #[inline]
    pub(in crate::transport) fn bsdf_at(&self, point: &SurfacePoint) -> Bsdf {
        Bsdf::at::<F>(self.scene, point.material, point.uv, point.front)
    }

    /// Whether photons are stored on the bases of narrow coats alone ([`Bsdf::is_varnished`]), whose coats
    /// are then sampled apart: where paths that leave by a coat find all light. They cannot find point and
    /// directional lights by mirrors and smooth glass.
    #[inline]
    pub(in crate::transport) fn separates_coats(&self) -> bool {
        !(self.has_mirrors && self.lights.have_deltas())
    }

    /// Whether a ray that started on triangle `left` passes `point` as if it were not there: by a cut-out,
    /// whose opacity does not exceed `random` (called for surfaces that have one), or by rounding on its own
    /// triangle.
    #[inline]
    pub(in crate::transport) fn is_passed(
        &self,
        point: &SurfacePoint,
        hit: &Hit,
        left: u32,
        random: impl FnOnce() -> f32,
    ) -> bool {
        hit.triangle == left || F::CUTOUT && point.material.has_cutout() && random() >= self.opacity_at(point)
    }

    /// The opacity of the surface at `point`: 1 unless it has a cut-out.
    #[inline]
    pub(in crate::transport) fn opacity_at(&self, point: &SurfacePoint) -> f32 {
        if F::CUTOUT { point.material.opacity.at::<F>(self.scene, point.uv).min(1.0) } else { 1.0 }
    }

    /// Follows `segment` to the surface that scatters it; a cut-out after n surfaces takes `random(n)`.
    /// `None` where it leaves the scene.
    pub(in crate::transport) fn next_surface(
        &self,
        segment: &mut Segment,
        random: impl Fn(u32) -> f32,
        counters: &mut Counters,
    ) -> Option<(Hit, SurfacePoint<'a>)> {
        counters.rays += 1;
        let hit = self.nearest(&segment.ray);
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
            let point = self.surface_at(&segment.ray, &hit)?;
            let (surfaces, length) = (segment.surfaces, segment.length + hit.t);
            if !self.is_passed(&point, &hit, segment.triangle, || random(surfaces)) {
                segment.length = length;
                return Some((hit, point));
            }
            if surfaces >= MAX_CROSSINGS {
                counters.dropped.unfinished += 1;
                return None;
            }
            let onward = segment.onward(&point, &hit, segment.ray.direction.into());
            *segment = Segment { length, ..onward };
            counters.rays += 1;
            hit = self.nearest(&segment.ray);
        }
    }
}
