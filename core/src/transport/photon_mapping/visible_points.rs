//! Visible points: surfaces that store photons, seen by a raster of camera rays directly, in mirrors and
//! through glass, in a map of their own. A photon counts as visible if a visible point is near. This may be
//! inexact, since guided emission sends some light everywhere.

use crate::bsdf::{Bsdf, Features};
use crate::memory::Footprint;
use crate::photon::{Kernel, Photon, PhotonMap, Photons, QueryDisc, Uniform};
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::photon_mapping::radius::RadiusSchedule;
use crate::transport::settings::Counters;
use crate::transport::walk::context::{SceneContext, Segment};
use crate::transport::walk::dimension;
use crate::transport::walk::vertex::Scatterer;
use crate::{Level, Rgb};
use core::mem;
use glam::Vec3;

/// Maximum number of camera rays.
const MAX_RAYS: u32 = 1 << 14;

/// Maximum number of specular surfaces on a camera ray.
const MAX_MIRRORS: u32 = 16;

/// Radius around a visible point, in distances between two rays.
const RADIUS_IN_STEPS: f32 = 1.5;

/// Raster of camera rays that find visible points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VisiblePointSampler {
    frame: [u32; 2],
    /// Distance between rays, in pixels.
    step: u32,
    /// True if the points are the hits of gather rays from the visible points.
    gathers: bool,
}

impl VisiblePointSampler {
    /// Number of rays of a task.
    pub const TASK: usize = 256;

    /// Raster for a picture of `frame` pixels across and down.
    pub fn new(frame: [u32; 2]) -> Self {
        let across = |step: u32| frame.map(|pixels| u64::from(pixels.div_ceil(step)));
        let mut step = 1;
        while across(step)[0] * across(step)[1] > u64::from(MAX_RAYS) {
            step += 1;
        }
        Self { frame, step, gathers: false }
    }

    /// This raster with one more bounce: one ray from each visible point to a surface that lights it.
    pub fn gathering(self) -> Self {
        Self { gathers: true, ..self }
    }

    /// Number of rays.
    pub fn rays(&self) -> usize {
        self.frame.iter().map(|pixels| pixels.div_ceil(self.step) as usize).product()
    }

    /// Footprint of the map of visible points.
    pub fn footprint(&self) -> Footprint {
        Photons::footprint(self.rays())
    }

    /// Visible points of task `task`, one per ray, as photons without power; a ray that finds none writes a
    /// photon that a map rejects. A task has [`VisiblePointSampler::TASK`] rays.
    #[inline(never)]
    pub fn run<F: Features>(
        &self,
        task: usize,
        context: &SceneContext<F>,
        seed: u32,
        out: &mut [Photon],
    ) -> Counters {
        let mut counters = Counters::default();
        for (i, slot) in out.iter_mut().enumerate() {
            let ray = (task * Self::TASK + i) as u32;
            *slot = self.along(context, (seed, ray), &mut counters).unwrap_or(Photon::NONE);
        }
        counters
    }

    /// Visible point of ray `number`, with numbers of `seed`.
    fn along<F: Features>(
        &self,
        context: &SceneContext<F>,
        number: (u32, u32),
        counters: &mut Counters,
    ) -> Option<Photon> {
        let Seen { point, to_viewer, .. } = self.seen(context, number, counters)?;
        Some(Photon::new(point.position, to_viewer, point.geometric_normal, Rgb::ZERO))
    }

    /// Corner of the cell of ray `number`, in pixels.
    pub fn pixel(&self, number: usize) -> [f64; 2] {
        let across = self.frame[0].div_ceil(self.step) as usize;
        [number % across, number / across].map(|i| f64::from(self.step) * i as f64)
    }

    /// The first surface along ray `number` that stores photons, with numbers of `seed`.
    pub(in crate::transport) fn seen<'a, F: Features>(
        &self,
        context: &SceneContext<'a, F>,
        (seed, number): (u32, u32),
        counters: &mut Counters,
    ) -> Option<Seen<'a>> {
        let [width, height] = self.frame;
        let across = width.div_ceil(self.step);
        let (mut throughput, mut is_first_rough, mut has_joint, mut is_rough) =
            (Rgb::ONE, true, false, false);
        let sampler = Sampler::new(seed, number, 0);
        let [u, v] = sampler.pair(dimension::PIXEL);
        let at = |i: u32, u: f32, pixels: u32| ((i as f32 + u) * self.step as f32).min(pixels as f32);
        let (x, y) = (at(number % across, u, width), at(number / across, v, height));
        let mut segment = Segment::first(context.scene.camera.ray(width, height, x, y, [0.5; 2]));
        let mut gathers = self.gathers;
        for segments in 1..=MAX_MIRRORS + 1 {
            let opacity = |n| sampler.single(dimension::CROSSING + n);
            let (hit, point) = context.next_surface(&mut segment, opacity, counters)?;
            throughput *= segment.passed;
            let direction = Vec3::from(segment.ray.direction).normalize_or_zero();
            let bsdf = context.bsdf_at(&point);
            if bsdf.gathers_photons(true) && !mem::take(&mut gathers) {
                has_joint |= is_rough;
                return Some(Seen {
                    point,
                    bsdf,
                    to_viewer: -direction,
                    throughput,
                    is_first_rough,
                    has_joint,
                });
            }
            let at = Scatterer { point: &point, bsdf: &bsdf };
            let (sample, onward) = at.sample::<F>(direction, dimension::bsdf_sample(&sampler, segments))?;
            throughput *= sample.weight;
            has_joint |= is_rough && !sample.delta;
            is_rough = !sample.delta;
            is_first_rough &= is_rough || segments > 1;
            segment = segment.onward(&point, &hit, onward);
        }
        None
    }
}

/// Surface at the end of a camera ray.
pub(in crate::transport) struct Seen<'a> {
    pub(in crate::transport) point: SurfacePoint<'a>,
    pub(in crate::transport) bsdf: Bsdf,
    /// Unit direction to the vertex before.
    pub(in crate::transport) to_viewer: Vec3,
    pub(in crate::transport) throughput: Rgb,
    /// True if the first surface is not specular, so that light paths may be connected to the camera.
    pub(in crate::transport) is_first_rough: bool,
    /// True if two neighbouring surfaces are not specular, so that they may be connected.
    pub(in crate::transport) has_joint: bool,
}

/// Visible points and their radius.
#[derive(Clone, Copy)]
pub struct VisiblePoints<'a> {
    map: &'a PhotonMap<'a>,
    radius: VisibleRadius,
    /// True if photons count by their light in the picture, not by their power.
    weighs_area: bool,
    level: Level,
}

/// Radius around a visible point.
#[derive(Clone, Copy)]
enum VisibleRadius {
    Schedule(RadiusSchedule),
    Constant(f32),
}

impl<'a> VisiblePoints<'a> {
    /// Visible points `map` of `raster`. Density estimates have a radius of at most `pixels` pixels; `discs`
    /// is the schedule of one pixel.
    pub fn new(
        map: &'a PhotonMap<'a>,
        raster: &VisiblePointSampler,
        discs: RadiusSchedule,
        pixels: f32,
        level: Level,
    ) -> Self {
        Self {
            map,
            radius: VisibleRadius::Schedule(
                discs.of_pixels(pixels.max(RADIUS_IN_STEPS * raster.step as f32)),
            ),
            weighs_area: false,
            level,
        }
    }

    /// These points, where photons count by their power over the area of their disc: by their light in the
    /// picture. Without, they count by their power, which is enough if most discs are alike.
    pub fn by_area(self, weighs_area: bool) -> Self {
        Self { weighs_area, ..self }
    }

    /// Visible points `map` with a constant `radius`.
    pub fn within(map: &'a PhotonMap<'a>, radius: f32, level: Level) -> Self {
        Self { map, radius: VisibleRadius::Constant(radius), weighs_area: false, level }
    }

    /// Benefit, up to a factor, of a photon of power 1 at `place`, on a surface with this
    /// `normal`; zero if it is not visible.
    pub(in crate::transport) fn importance(&self, place: Vec3, normal: Vec3) -> f32 {
        let radius = match self.radius {
            VisibleRadius::Schedule(discs) => discs.radius(place),
            VisibleRadius::Constant(radius) => radius,
        };
        let importance = if self.weighs_area { 1.0 / (radius * radius) } else { 1.0 };
        let disc = QueryDisc { place, normal, radius, kernel: Kernel::Constant };
        let is_visible = self.map.gather(self.level, &disc, &Uniform(Rgb::ONE)).photons > 0;
        if is_visible { importance } else { 0.0 }
    }
}
