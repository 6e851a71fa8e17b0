//! What the camera sees that holds photons: places of a raster of camera rays, straight on, in mirrors and
//! behind glass, in a map of their own. A photon counts as seen where one of them lies near it. That need not
//! be exact: emission guided by it sends some light everywhere.

use crate::bsdf::Features;
use crate::memory::Footprint;
use crate::photon::{Kernel, Photon, PhotonMap, Photons, QueryDisc, Uniform};
use crate::sampling::Sampler;
use crate::transport::photon_mapping::radius::RadiusSchedule;
use crate::transport::settings::Counters;
use crate::transport::walk::context::{SceneContext, Segment};
use crate::transport::walk::dimension;
use crate::{Level, Rgb};
use core::mem;
use glam::Vec3;

/// Camera rays, at most.
const MOST_RAYS: u32 = 1 << 14;

/// Mirrors and surfaces of glass on the way, at most.
const MOST_MIRRORS: u32 = 16;

/// How far places stand for others, in distances between two.
const REACH: f32 = 1.5;

/// The camera rays that look for places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VisiblePointSampler {
    frame: [u32; 2],
    /// Pixels from ray to ray.
    step: u32,
    /// Whether places are those that rays go to from what is seen, as they gather light for it.
    gathers: bool,
}

impl VisiblePointSampler {
    /// Rays of a task.
    pub const TASK: usize = 256;

    /// For a picture that is `frame` pixels wide and high.
    pub fn new(frame: [u32; 2]) -> Self {
        let across = |step: u32| frame.map(|pixels| u64::from(pixels.div_ceil(step)));
        let mut step = 1;
        while across(step)[0] * across(step)[1] > u64::from(MOST_RAYS) {
            step += 1;
        }
        Self { frame, step, gathers: false }
    }

    /// The same one bounce further: from each place one ray goes on, to what lights it.
    pub fn gathering(self) -> Self {
        Self { gathers: true, ..self }
    }

    /// How many rays there are.
    pub fn rays(&self) -> usize {
        self.frame.iter().map(|pixels| pixels.div_ceil(self.step) as usize).product()
    }

    /// Bytes of the map of the places.
    pub fn footprint(&self) -> Footprint {
        Photons::footprint(self.rays())
    }

    /// What the rays of task `task`, [`VisiblePointSampler::TASK`] of them, find: places, as photons without
    /// power; where there is none, one that a map refuses.
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

    fn along<F: Features>(
        &self,
        context: &SceneContext<F>,
        (seed, number): (u32, u32),
        counters: &mut Counters,
    ) -> Option<Photon> {
        let [width, height] = self.frame;
        let across = width.div_ceil(self.step);
        let sampler = Sampler::new(seed, number, 0);
        let [u, v] = sampler.pair(dimension::PIXEL);
        let at = |i: u32, u: f32, pixels: u32| ((i as f32 + u) * self.step as f32).min(pixels as f32);
        let (x, y) = (at(number % across, u, width), at(number / across, v, height));
        let mut segment = Segment::first(context.scene.camera.ray(width, height, x, y, [0.5; 2]));
        let mut gathers = self.gathers;
        for segments in 1..=MOST_MIRRORS + 1 {
            let opacity = |n| sampler.single(dimension::CROSSING + n);
            let (hit, point) = context.next_surface(&mut segment, opacity, counters)?;
            let direction = Vec3::from(segment.ray.direction).normalize_or_zero();
            let bsdf = context.bsdf_at(&point);
            if bsdf.gathers_photons(true) && !mem::take(&mut gathers) {
                return Some(Photon::new(point.position, -direction, point.geometric_normal, Rgb::ZERO));
            }
            let [u, v] = dimension::scattering(&sampler, segments);
            let lobe = sampler.single(dimension::vertex(segments) + dimension::LOBE);
            let sample = bsdf.sample::<F>(point.frame.to_local(-direction), [u, v, lobe])?;
            let onward = point.frame.to_world(sample.direction);
            if !point.sides_agree(sample.direction, onward) {
                return None;
            }
            segment = segment.onward(&point, &hit, onward);
        }
        None
    }
}

/// The places, and how far each stands for others.
#[derive(Clone, Copy)]
pub struct VisiblePoints<'a> {
    map: &'a PhotonMap<'a>,
    reach: Reach,
    level: Level,
}

/// How far a place stands for others.
#[derive(Clone, Copy)]
enum Reach {
    RadiusSchedule(RadiusSchedule),
    Everywhere(f32),
}

impl<'a> VisiblePoints<'a> {
    /// Of the places in `map`, which `raster` found. Light is gathered from discs of so many pixels, at most;
    /// `discs` are those of one.
    pub fn new(
        map: &'a PhotonMap<'a>,
        raster: &VisiblePointSampler,
        discs: RadiusSchedule,
        pixels: f32,
        level: Level,
    ) -> Self {
        Self {
            map,
            reach: Reach::RadiusSchedule(discs.of_pixels(pixels.max(REACH * raster.step as f32))),
            level,
        }
    }

    /// Of the places in `map`, each of which stands for what is no further from it than `radius`.
    pub fn within(map: &'a PhotonMap<'a>, radius: f32, level: Level) -> Self {
        Self { map, reach: Reach::Everywhere(radius), level }
    }

    /// Whether a photon at `place`, on a surface of `normal`, is seen.
    pub(in crate::transport) fn shows(&self, place: Vec3, normal: Vec3) -> bool {
        let radius = match self.reach {
            Reach::RadiusSchedule(discs) => discs.radius(place),
            Reach::Everywhere(radius) => radius,
        };
        let disc = QueryDisc { place, normal, radius, kernel: Kernel::Constant };
        self.map.gather(self.level, &disc, &Uniform(Rgb::ONE)).photons > 0
    }
}
