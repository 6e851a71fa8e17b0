//! View-bound records: points whose narrow lobe the camera sees, their gather rays, and their look-up.
//!
//! A gather ray finds the light that its hit reflects, as one of irradiance does; light that its hit emits or
//! mirrors stays with the path of the picture. The gather rays end in irradiance caches that are frozen.

use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::cache::irradiance::{IrradianceCache, QueryPoint, Record, metric, validity};
use crate::cache::radiance::ServedLobes;
use crate::cache::view::{LobeKind, LobeSamples, ViewRecords, ViewedLobe};
use crate::geometry::Frame;
use crate::light::luminance;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::Sampler;
use crate::scene::{CameraKind, Scene, Surface, SurfacePoint};
use crate::transport::cached::gather::{GatherPoint, HemisphereSamples, NO_PIXEL};
use crate::transport::cached::placement::ProgressiveOrder;
use crate::transport::path::sharing::PathWave;
use crate::transport::path::{LightEstimator, PathIntegrator, WAVE};
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::{SceneContext, Segment};
use crate::transport::walk::dimension;
use crate::transport::wavefront::Wavefront;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Strata along a side of the lobe of a record.
pub const SIDE: usize = 16;

/// Alpha of the lobes that view-bound records serve where coefficients do not, from 0.05 but for rounding.
const ALPHAS: core::ops::RangeInclusive<f32> = 0.049..=0.5;

/// Smallest cosine of a viewer to the normal.
const LEAST_COSINE: f32 = 0.05;

/// Largest squared distance of the shading normal from the geometric normal: records lie on flat surfaces.
const FLAT: f32 = 1e-6;

/// Bit of the pixel numbers of gathers for view-bound records.
const VIEWS: u32 = 1 << 29;

/// Point whose narrow lobe the camera sees.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct ViewPoint {
    /// The point; [`GatherPoint::NONE`] for no point.
    pub point: GatherPoint,
    /// Kind of its lobe.
    pub kind: LobeKind,
    /// Step of the pixel in the order of placement.
    pub(in crate::transport) step: u32,
}

/// Settings of gathering for view-bound records.
#[derive(Clone, Copy)]
pub struct ViewGathering<'c> {
    /// Pixels of the picture in the order of placement, and the sample of each that finds points.
    pub order: (ProgressiveOrder, u32),
    /// Error metric.
    pub metric: metric::Settings,
    /// Minimum radius of a record, in pixels.
    pub least_pixels: f32,
    /// Irradiance of the bases of coats.
    pub irradiance: &'c IrradianceCache<'c>,
}

/// True if view-bound records may serve lobes of `scene`.
pub fn may_serve(scene: &Scene) -> bool {
    scene.materials.iter().any(|material| match &material.surface {
        Surface::Conductor { roughness, .. } | Surface::Glossy { roughness, .. } => {
            roughness.texture.is_some() || ALPHAS.contains(&(roughness.value * roughness.value))
        }
        _ => false,
    })
}

/// Lobe of `point`, seen by a camera ray along `direction`, and its kind, if view-bound records serve it.
fn viewed_lobe<F: Features>(
    context: &SceneContext<F>,
    point: &SurfacePoint,
    direction: Vec3,
) -> Option<(Bsdf, ViewedLobe, LobeKind)> {
    let (Surface::Conductor { .. } | Surface::Glossy { .. }) = point.material.surface else { return None };
    // Records are bound to one eye.
    if matches!(context.scene.camera.kind, CameraKind::Orthographic { .. }) {
        return None;
    }
    let to_eye = context.scene.camera.eye - point.position;
    let bsdf = context.bsdf_at(point);
    let lobe = ViewedLobe::new(&bsdf, point.frame.to_local(to_eye.normalize()), to_eye.length())?;
    let material = context.scene.mesh.material(point.triangle)?;
    let kind = LobeKind { material, alpha: lobe.alpha() };
    let is_served = ALPHAS.contains(&kind.alpha)
        && point.frame.normal.distance_squared(point.geometric_normal) <= FLAT
        && point.frame.normal.dot(-direction) >= LEAST_COSINE
        && kind.is_aligned(to_eye.normalize(), -direction)
        // The base of a coat needs a record of its own.
        && (bsdf.base() == Rgb::ZERO || bsdf.has_coated_base());
    is_served.then_some((bsdf, lobe, kind))
}

/// Lobe at `point`, the hit of ray `ray` of the wave, its kind, and the sample number of its path, if
/// view-bound records serve it.
fn seen_lobe<F: Features>(
    (context, settings): (&SceneContext<F>, &PathSettings),
    (wave, ray): (&Wavefront, usize),
    point: &SurfacePoint,
) -> Option<(ViewedLobe, LobeKind, u32)> {
    let ray = wave.rays.get(ray)?;
    let path = wave.paths.get(ray.tag as usize)?;
    if path.segments != 1 || !path.classes.has_rough() || settings.max_depth <= 1 {
        return None;
    }
    let (_, lobe, kind) = viewed_lobe(context, point, ray.direction.into())?;
    Some((lobe, kind, path.sample))
}

/// True if view-bound records serve the lobe at `point`, the hit of ray `ray` of the wave.
pub(in crate::transport) fn is_seen<F: Features>(
    of: (&SceneContext<F>, &PathSettings),
    ray: (&Wavefront, usize),
    point: &SurfacePoint,
) -> bool {
    seen_lobe(of, ray, point).is_some()
}

/// Radiance that the lobe at `point` reflects to the camera, if view-bound records serve it: `point` is the
/// hit of ray `ray` of the wave.
pub(in crate::transport) fn reflected<F: Features>(
    of: (&SceneContext<F>, &PathSettings),
    views: &[&ViewRecords; 2],
    ray: (&Wavefront, usize),
    point: &SurfacePoint,
) -> Option<Rgb> {
    let (lobe, kind, sample) = seen_lobe(of, ray, point)?;
    let query = QueryPoint::open(point.position, point.frame.normal);
    let radiance = views[sample as usize & 1].at(&query, &kind)?;
    Some(radiance * lobe.reflectance())
}

impl<F: Features> PathIntegrator<'_, F> {
    /// Scratch memory of [`PathIntegrator::gather_view`].
    pub fn view_scratch<E: LightEstimator<F>>() -> Footprint {
        let strata = SIDE * SIDE;
        let wave = PathWave::<E::State, ()>::footprint(strata.min(WAVE));
        wave.and(HemisphereSamples::footprint(SIDE)).slice::<[f32; 2]>(strata)
    }
}

impl<F: Features, E: LightEstimator<F>> PathIntegrator<'_, F, E> {
    /// Point of step `step` of the order whose narrow lobe the camera sees, with its lobe. Records with
    /// coefficients serve `lobes` in its place.
    fn see(
        &self,
        (order, sample): (&ProgressiveOrder, u32),
        step: u32,
        lobes: Option<&ServedLobes>,
        counters: &mut Counters,
    ) -> Option<(ViewPoint, Bsdf, ViewedLobe)> {
        let [width, height] = [self.settings.width, self.settings.height];
        let (x, y) = order.pixel(u64::from(step))?;
        let sampler = Sampler::new(self.settings.seed, y * width + x, sample);
        let mut segment = Segment::first(self.camera_ray([x, y], &sampler));
        let opacity = |n| sampler.single(dimension::CROSSING + n);
        let (_, point) = self.context.next_surface(&mut segment, opacity, counters)?;
        let direction = Vec3::from(segment.ray.direction);
        let (bsdf, lobe, kind) = viewed_lobe(&self.context, &point, direction)?;
        if lobes.is_some_and(|lobes| lobes.serves(&bsdf, point.frame.normal.dot(-direction))) {
            return None;
        }
        let pixel = self.context.scene.camera.pixel_width(height).per_length;
        let point = GatherPoint::of(&point, pixel * segment.length);
        Some((ViewPoint { point, kind, step }, bsdf, lobe))
    }

    /// Points of the steps from `first` on whose narrow lobe the camera sees, one for each entry of `out`.
    #[inline(never)]
    pub fn view_points(
        &self,
        (order, sample): (&ProgressiveOrder, u32),
        first: u32,
        lobes: Option<&ServedLobes>,
        out: &mut [ViewPoint],
        counters: &mut Counters,
    ) {
        for (step, out) in (first..).zip(out) {
            let seen = self.see((order, sample), step, lobes, counters);
            *out = seen.map_or(ViewPoint::NONE, |(point, ..)| point);
        }
    }

    /// Gathers a record at `place`. Each `number` has different rays. `None` if the radiance is not finite,
    /// which is counted as dropped.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PathIntegrator::view_scratch`].
    #[inline(never)]
    pub fn gather_view(
        &self,
        place: &ViewPoint,
        number: u32,
        gathering: &ViewGathering,
        scratch: &mut Arena,
        counters: &mut Counters,
    ) -> Result<Option<Record>, OutOfMemory> {
        let (order, sample) = &gathering.order;
        let Some((_, bsdf, lobe)) = self.see((order, *sample), place.step, None, counters) else {
            return Ok(None);
        };
        let place = &place.point;
        let mut arena = scratch.scratch();
        let mut strata = HemisphereSamples::new(SIDE, gathering.metric.metric, false, &mut arena)?;
        let frame = Frame::from_normal(place.normal());
        let pixel = NO_PIXEL | VIEWS | number;
        let point_of = |stratum: usize| {
            let [u, v] = Sampler::new(self.settings.seed, pixel, stratum as u32).pair(dimension::PIXEL);
            [((stratum / SIDE) as f32 + u) / SIDE as f32, ((stratum % SIDE) as f32 + v) / SIDE as f32]
        };
        let points: &mut [[f32; 2]] = arena.slice(SIDE * SIDE)?;
        points.iter_mut().enumerate().for_each(|(stratum, point)| *point = point_of(stratum));
        let generate = |stratum| {
            let direction = lobe.direction(point_of(stratum));
            let ray = place.ray(frame.to_world(direction));
            (direction, ray, place.path(pixel, stratum as u32, stratum))
        };
        self.trace_strata(&frame, &mut strata, &mut arena, generate, counters)?;
        let samples = LobeSamples {
            n: SIDE,
            points,
            radiance: strata.radiance,
            inverse_distance: strata.inverse_distance,
        };
        let Some(found) = lobe.reflected(samples).filter(|found| found.derivatives.irradiance.is_finite())
        else {
            counters.dropped.nan += 1;
            return Ok(None);
        };
        let base = gathering.irradiance.at(&place.query()).map_or(Rgb::ZERO, |known| {
            bsdf.base_radiance(lobe.viewer(), known.irradiance, known.edge_moment)
        });
        let picture = place.pixel * libm::sqrtf(self.settings.width as f32 * self.settings.height as f32);
        let metric = gathering.metric.within(picture);
        let reflected = found.derivatives.irradiance * lobe.reflectance();
        // Errors are relative to all that leaves towards the camera.
        let all = luminance(reflected + base) / luminance(reflected);
        let error = if all.is_finite() { metric.error * all } else { metric.error };
        let settings = metric::Settings { error, least: gathering.least_pixels * place.pixel, ..metric };
        let derivatives = found.trusted();
        let reach = validity(&settings, &derivatives);
        let mut record = Record::new(place.position(), &frame, &derivatives, &reach);
        // The lobe is not rigid, so that its second order decides radii only.
        record.bend = [0.0; 2];
        let light = derivatives.luminance();
        let square = light * light;
        record.set_noise(if light > 0.0 { found.variance / square } else { 0.0 });
        if light > 0.0 {
            record.mean_square_inverse_distance = found.gradient_spread();
        }
        self.find_boundary(&mut record, place, &frame, &strata, counters);
        Ok(Some(record))
    }
}

impl ViewPoint {
    /// No point.
    pub const NONE: ViewPoint =
        ViewPoint { point: GatherPoint::NONE, kind: LobeKind { material: 0, alpha: 0.0 }, step: 0 };
}
