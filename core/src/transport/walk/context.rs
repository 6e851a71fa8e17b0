//! Scene, BVH, lights and instruction set of transport, and the walk from surface to surface of all subpaths.

use crate::bsdf::{Bsdf, Features, Pane};
use crate::bvh::{Bvh, Coherence};
use crate::geometry::{Hit, MISS, Ray};
use crate::light::LightSampler;
use crate::scene::{Material, Scene, SurfacePoint};
use crate::transport::settings::Counters;
use crate::transport::walk::termination::MAX_CROSSINGS;
use crate::{Level, Rgb};
use bytemuck::{Pod, Zeroable};
use core::marker::PhantomData;
use glam::Vec3;

/// Scene that is ready for rays. `F` has at least the features of the scene ([`crate::census`]).
#[derive(Clone, Copy)]
pub struct SceneContext<'a, F> {
    /// Geometry, materials, camera.
    pub scene: &'a Scene<'a>,
    /// BVH over the triangles.
    pub bvh: Bvh<'a>,
    /// Sampler of the lights.
    pub lights: LightSampler<'a>,
    /// Highest instruction set to use.
    pub level: Level,
    /// True if a surface may have an opacity below 1, so that shadow rays continue behind a hit.
    pub(crate) has_cutouts: bool,
    /// True if a surface may reflect or refract in a single direction only.
    pub(crate) has_mirrors: bool,
    features: PhantomData<F>,
}

/// Origin of a ray of a subpath.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Origin {
    /// Its triangle, which the ray cannot hit again; [`MISS`] at the camera.
    pub(crate) triangle: u32,
    /// Surfaces that the subpath has passed so far, by cut-out or rounding.
    pub(crate) crossings: u32,
}

/// Ray between two surfaces of a subpath.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) ray: Ray,
    /// Triangle at the origin of the ray, which the ray cannot hit again; [`MISS`] at the camera.
    pub(crate) triangle: u32,
    /// Number of surfaces of the subpath so far, both scattering and skipped.
    pub(crate) surfaces: u32,
    /// Distance from the last scattering surface, in lengths of the ray's direction.
    pub(crate) length: f32,
    /// Factor on the throughput by panes since then.
    pub(crate) passed: Rgb,
}

impl Segment {
    /// First segment of a subpath, from the camera or a light.
    pub(crate) fn first(ray: Ray) -> Self {
        Self { ray, triangle: MISS, surfaces: 0, length: 0.0, passed: Rgb::ONE }
    }

    /// Next segment, from `point` on the triangle of `hit` along `direction`, in world space.
    pub(crate) fn onward(&self, point: &SurfacePoint, hit: &Hit, direction: Vec3) -> Self {
        let (ray, surfaces) = (point.spawn(direction), self.surfaces + 1);
        Self { ray, triangle: hit.triangle, surfaces, length: 0.0, passed: Rgb::ONE }
    }
}

impl<'a, F: Features> SceneContext<'a, F> {
    /// Context of a scene; rays use instructions up to `level`.
    pub fn new(scene: &'a Scene<'a>, bvh: &Bvh<'a>, lights: &LightSampler<'a>, level: Level) -> Self {
        let has_cutouts = F::CUTOUT && scene.materials.iter().any(Material::has_cutout);
        let has_mirrors = scene.materials.iter().any(|material| material.surface.may_be_smooth());
        Self { scene, bvh: *bvh, lights: *lights, level, has_cutouts, has_mirrors, features: PhantomData }
    }

    /// True if blocks of vertices are shaded in lanes. The baseline gains nothing by them, as measured with
    /// SSE2.
    #[inline]
    pub(crate) fn has_lanes(&self) -> bool {
        cfg!(target_arch = "x86_64") && self.level > Level::BASELINE
    }

    /// True if light of lights without extent may come by mirrors and smooth glass, which camera paths do not
    /// find.
    pub fn has_hidden_light(&self) -> bool {
        self.has_mirrors && self.lights.has_delta_lights()
    }

    /// Nearest hit of `ray`.
    #[inline]
    pub(crate) fn nearest(&self, ray: &Ray) -> Hit {
        let hit = self.bvh.nearest(self.level, ray);
        if self.scene.mesh.has_overlaps() { self.scene.visible_hit(ray, hit) } else { hit }
    }

    /// Nearest hits of `rays`.
    #[inline]
    pub(crate) fn nearest_batch(&self, rays: &[Ray], coherence: Coherence, hits: &mut [Hit]) {
        self.bvh.nearest_batch(self.level, rays, coherence, hits);
        if self.scene.mesh.has_overlaps() {
            rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.scene.visible_hit(ray, *hit));
        }
    }

    /// Surface point of `ray` at `hit`.
    #[inline]
    pub(crate) fn surface_at(&self, ray: &Ray, hit: &Hit) -> Option<SurfacePoint<'a>> {
        SurfacePoint::at::<F>(self.scene, ray, hit).filter(|_| hit.is_some())
    }

    /// BSDF at `point`.
    #[inline]
    pub(crate) fn bsdf_at(&self, point: &SurfacePoint) -> Bsdf {
        Bsdf::at::<F>(self.scene, point.material, &point.attributes, point.front)
    }

    /// True if photons are stored only on the bases of narrow coats ([`Bsdf::gathers_photons_on_base`]),
    /// whose coats are then sampled separately. Paths that leave by a coat have to find all light; they
    /// cannot find point and directional lights behind mirrors and smooth glass.
    #[inline]
    pub(crate) fn separates_coats(&self) -> bool {
        !self.has_hidden_light()
    }

    /// Factor on the throughput of a ray from triangle `left` that skips `point`, its hit; `None` if it stops
    /// there. It skips a cut-out or pane whose opacity does not exceed `random` (evaluated for those only),
    /// and its own triangle, hit by rounding.
    #[inline]
    pub(crate) fn passed(
        &self,
        point: &SurfacePoint,
        (ray, hit): (&Ray, &Hit),
        left: u32,
        random: impl FnOnce() -> f32,
    ) -> Option<Rgb> {
        if hit.triangle == left {
            return Some(Rgb::ONE);
        }
        if !(F::CUTOUT && point.material.has_cutout()) {
            return None;
        }
        let Some(passing) = self.passing_pane(point, ray) else {
            return (random() >= self.opacity_at(point)).then_some(Rgb::ONE);
        };
        let most = passing.max_element();
        (random() >= 1.0 - most).then(|| passing / most)
    }

    /// Part of the light along `ray` that passes `point` straight on, if that is on a pane.
    #[inline]
    fn passing_pane(&self, point: &SurfacePoint, ray: &Ray) -> Option<Rgb> {
        let pane = Pane::of(&point.material.surface)?;
        let [_, passing] = pane.parts(point.frame.normal.dot(Vec3::from(ray.direction).normalize_or_zero()));
        Some(Rgb::ONE - self.opacity_at(point).max(0.0) * (Rgb::ONE - passing))
    }

    /// Part of the light along `ray` that passes `point` straight on, by cut-out or pane.
    #[inline]
    pub(crate) fn passing(&self, point: &SurfacePoint, ray: &Ray) -> Rgb {
        let by_opacity = || Rgb::splat(1.0 - self.opacity_at(point).clamp(0.0, 1.0));
        self.passing_pane(point, ray).unwrap_or_else(by_opacity)
    }

    /// `Err` if a `ray` from `origin` passes `point`, its `hit`: the ray behind it, or `None` after
    /// [`MAX_CROSSINGS`] surfaces. A coloured pane changes the `throughput`. A ray that is `at_lens` does not
    /// see the back of the surface that the camera is on. A cut-out after n others uses `random(n)`.
    #[inline]
    pub(crate) fn stop(
        &self,
        (origin, throughput): (&mut Origin, &mut [f32; 3]),
        (ray, hit, point): (&Ray, &Hit, &SurfacePoint),
        at_lens: bool,
        random: impl FnOnce(u32) -> f32,
        counters: &mut Counters,
    ) -> Result<(), Option<Ray>> {
        let Origin { triangle, crossings } = *origin;
        let is_left = at_lens && point.is_left_by(ray);
        let passed = || self.passed(point, (ray, hit), triangle, || random(crossings));
        let Some(factor) = is_left.then_some(Rgb::ONE).or_else(passed) else { return Ok(()) };
        if crossings >= MAX_CROSSINGS {
            counters.dropped.unfinished += 1;
            return Err(None);
        }
        *origin = Origin { triangle: hit.triangle, crossings: crossings + 1 };
        *throughput = (Rgb::from(*throughput) * factor).to_array();
        Err(Some(point.spawn(ray.direction.into())))
    }

    /// Opacity at `point`: 1 unless its material is a cut-out.
    #[inline]
    pub(crate) fn opacity_at(&self, point: &SurfacePoint) -> f32 {
        if F::CUTOUT { point.material.opacity.at::<F>(self.scene, &point.attributes).min(1.0) } else { 1.0 }
    }

    /// Follows `segment` to the next scattering surface; a cut-out after n surfaces uses `random(n)`. `None`
    /// if the ray leaves the scene or skips more than [`MAX_CROSSINGS`] surfaces.
    pub(crate) fn next_surface(
        &self,
        segment: &mut Segment,
        random: impl Fn(u32) -> f32,
        counters: &mut Counters,
    ) -> Option<(Hit, SurfacePoint<'a>)> {
        counters.rays += 1;
        let hit = self.nearest(&segment.ray);
        self.surface_from(hit, segment, random, counters)
    }

    /// [`Self::next_surface`] of a segment whose ray was already traced, with result `hit`.
    pub(crate) fn surface_from(
        &self,
        mut hit: Hit,
        segment: &mut Segment,
        random: impl Fn(u32) -> f32,
        counters: &mut Counters,
    ) -> Option<(Hit, SurfacePoint<'a>)> {
        loop {
            let point = self.surface_at(&segment.ray, &hit)?;
            let (surfaces, length) = (segment.surfaces, segment.length + hit.t);
            let passed = self.passed(&point, (&segment.ray, &hit), segment.triangle, || random(surfaces));
            let Some(factor) = passed else {
                segment.length = length;
                return Some((hit, point));
            };
            if surfaces >= MAX_CROSSINGS {
                counters.dropped.unfinished += 1;
                return None;
            }
            let onward = segment.onward(&point, &hit, segment.ray.direction.into());
            *segment = Segment { length, passed: segment.passed * factor, ..onward };
            counters.rays += 1;
            hit = self.nearest(&segment.ray);
        }
    }
}
