//! Evaluation of points of primary sample space, a batch together: the light that each brings to a pixel.
//!
//! A point of multiplexed chains (Hachisuka et al. 2014) is one technique (s, t) of paths of one length,
//! which a random number chooses. Its light is the weighted contribution of the technique times the number of
//! techniques. A point of PSSMLT (Kelemen et al. 2002) is a whole path of path tracing.

use super::lane::Lane;
use super::lanes::{LANES, Lanes};
use super::numbers::{EmissionNumbers, PLACE_IN_PICTURE, Point, SLOTS_OF_PATH, Tail, slots_of_technique};
use super::paths::{Part, Path, Paths};
use super::split::{MIN_SEGMENTS, PrimarySpace, Split};
use super::technique::{Technique, technique};
use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::film::Tile;
use crate::geometry::{Hit, Ray};
use crate::light::{EmissionSampler, luminance};
use crate::sampling::Mutation;
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::shading::{ShadedHit, Shading, VertexNumbers};
use crate::transport::walk::subpath::Walk;
use crate::transport::walk::techniques::{LensSample, Weighted};
use crate::transport::walk::vertex::Scatterer;
use bytemuck::{Pod, Zeroable};
use core::mem::take;
use glam::{Vec2, Vec3};

/// Vertices from which a path of path tracing may be drawn anew.
const VERTICES_OF_TAILS: u32 = 4;

/// Kinds of steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// All numbers change a little.
    Small,
    /// All numbers are drawn anew.
    Large,
    /// Those of a tail of one subpath are drawn anew.
    Subpath,
}

/// The light of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Value {
    /// Radiance for the pixel, if all of the picture's samples fell into it.
    pub radiance: [f32; 3],
    /// Position of the pixel in the film.
    pub pixel: u32,
}

/// Evaluates points.
#[derive(Clone, Copy)]
pub struct Target<'a, F> {
    walk: Walk<'a, F>,
    paths: Paths<'a, F>,
    pub(super) split: Split<'a>,
}

impl<'a, F: Features> Target<'a, F> {
    /// The part of chains of the light of a picture by `settings`, divided by `split`.
    pub fn new(
        context: SceneContext<'a, F>,
        emission: &'a EmissionSampler<'a>,
        settings: PathSettings,
        split: Split<'a>,
    ) -> Self {
        let paths = Paths::new(context, emission, settings, split);
        Self { walk: paths.walk, paths, split }
    }

    /// Numbers of a point for paths of a length.
    pub(super) fn slots(&self, segments: u32) -> usize {
        match self.split.space {
            PrimarySpace::Multiplexed => slots_of_technique(segments),
            PrimarySpace::PathTracing => SLOTS_OF_PATH,
        }
    }

    /// Proposes a point.
    pub(super) fn propose(
        &self,
        step: Step,
        mutation: &Mutation,
        segments: u32,
        from: &[f32],
        to: &mut [f32],
    ) {
        match step {
            Step::Small => mutation.perturb(from, to, PLACE_IN_PICTURE),
            Step::Large => mutation.renew(from, to, |_| true),
            Step::Subpath => {
                let tail = self.tail(segments, from, mutation.choice());
                match self.split.space {
                    PrimarySpace::Multiplexed => {
                        mutation.renew(from, to, |slot| tail.has_slot_of_technique(slot));
                    }
                    PrimarySpace::PathTracing => mutation.renew(from, to, |slot| tail.has_slot_of_path(slot)),
                }
            }
        }
    }

    /// The tail of a subpath that numbers `u` choose. It depends on the technique alone.
    fn tail(&self, segments: u32, numbers: &[f32], [side, vertex]: [f32; 2]) -> Tail {
        let of = |from_light, vertices: u32| Tail { from_light, first: (vertex * vertices as f32) as u32 };
        if self.split.space == PrimarySpace::PathTracing {
            return of(false, VERTICES_OF_TAILS);
        }
        match technique(segments, numbers) {
            Technique::Hit => of(false, segments),
            Technique::LightSample => of(false, segments),
            Technique::Splat => of(true, segments - 1),
            Technique::Connection(light) if side < 0.5 => of(true, light),
            Technique::Connection(light) => of(false, segments - 1 - light),
        }
    }

    /// Numbers of segments that points are for.
    pub fn lengths(&self) -> core::ops::RangeInclusive<u32> {
        match self.split.space {
            PrimarySpace::Multiplexed => MIN_SEGMENTS..=self.split.max_segments,
            PrimarySpace::PathTracing => MIN_SEGMENTS..=MIN_SEGMENTS,
        }
    }

    /// The density that chains have, up to a factor: luminance, relative to the level of the pixel.
    pub(super) fn density(&self, value: &Value) -> f32 {
        let density = luminance(value.radiance.into()) / self.split.level(value.pixel);
        if density > 0.0 && density < f32::INFINITY { density } else { 0.0 }
    }

    /// Evaluates the first `values.len()` lanes: `point` of each, for paths of a length.
    pub(super) fn evaluate<'p>(
        &self,
        lanes: &mut Lanes,
        point: impl Fn(usize) -> (Point<'p>, u32),
        values: &mut [Value],
        counters: &mut Counters,
    ) {
        values.fill(Value::default());
        if self.split.space == PrimarySpace::PathTracing {
            return self.evaluate_paths(lanes, |lane| point(lane).0, values, counters);
        }
        let lane = |number| {
            let (point, segments) = point(number);
            Lane { number, segments, technique: technique(segments, point.numbers), point }
        };
        self.trace_lights(lanes, &lane, values, counters);
        self.trace_cameras(lanes, &lane, values, counters);
        let Lanes { shadows, .. } = lanes;
        shadows.trace(&self.walk.context, counters, |ray, light| {
            if let Some(value) = values.get_mut(ray.tag as usize) {
                value.radiance = light.to_array();
            }
        });
    }

    /// Light subpaths, and their splats.
    fn trace_lights<'p>(
        &self,
        lanes: &mut Lanes,
        lane: &impl Fn(usize) -> Lane<'p>,
        values: &mut [Value],
        counters: &mut Counters,
    ) {
        let mut active = 0;
        for number in 0..values.len().min(LANES) {
            lanes.end_hits[number] = Hit::NONE;
            let Lane { segments, technique, point, .. } = lane(number);
            if technique.subpaths(segments)[0] == 0 {
                continue;
            }
            if let Some((subpath, ray)) = self.walk.start_at_light(&EmissionNumbers(point)) {
                lanes.lights[number] = subpath;
                lanes.rays[active] = Ray { tag: number as u32, ..ray };
                active += 1;
            }
        }
        let numbers = |lanes: &Lanes, tag: u32| lane(tag as usize).of_light(lanes);
        self.advance((lanes, active), counters, numbers, |lanes, end, counters| {
            let lane = lane(end.0.tag as usize);
            self.light_step(&lane, lanes, end, &mut values[lane.number], counters)
        });
    }

    /// Advances subpaths by the first `active` rays of `lanes`, whose tags are their lanes, until none is
    /// left. `numbers` gives the segments of a lane's subpath and the numbers of its vertex; one `step`
    /// handles the end of a ray and gives the next.
    fn advance(
        &self,
        (lanes, mut active): (&mut Lanes, usize),
        counters: &mut Counters,
        numbers: impl Fn(&Lanes, u32) -> Option<(u32, VertexNumbers)>,
        mut step: impl FnMut(&mut Lanes, (&Ray, &Hit, ShadedHit), &mut Counters) -> Option<Ray>,
    ) {
        let mut shading = Shading::new();
        let (rays, hits) = (take(&mut lanes.rays), take(&mut lanes.hits));
        while active > 0 {
            let traced = (&mut rays[..active], &mut hits[..active], Coherence::Incoherent);
            let step =
                |lanes: &mut Lanes, _, end: (&_, &_, ShadedHit), counters: &mut _| step(lanes, end, counters);
            active = shading.advance(&self.walk.context, traced, counters, lanes, &numbers, step);
        }
        (lanes.rays, lanes.hits) = (rays, hits);
    }

    fn light_step(
        &self,
        lane: &Lane,
        lanes: &mut Lanes,
        (ray, hit, shaded): (&Ray, &Hit, ShadedHit),
        value: &mut Value,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let Lane { number, segments, technique, point: numbers } = *lane;
        let light = &mut lanes.lights[number];
        let point = shaded.met.point()?;
        let (met, opacity) = ((ray, hit, &point), |n| numbers.opacity(n, true));
        if let Err(behind) = self.walk.stop(&mut light.subpath, met, false, opacity, counters) {
            return behind;
        }
        let bsdf = shaded.bsdf::<F>(self.walk.context.scene);
        let at = Scatterer { point: &point, bsdf: &bsdf };
        let (vertex, path_sums) = self.walk.light_vertex(light, at, ray.direction.into())?;
        let arrived = light.subpath.segments;
        if arrived < technique.subpaths(segments)[0] {
            let u = || numbers.scattering(arrived, true);
            let sample = shaded.scattered(|| bsdf.sample::<F>(vertex.wo, u()))?;
            return self.walk.scatter_light(light, (&vertex, &path_sums), &sample);
        }
        (light.subpath.sums, light.path_sums) = (vertex.sums, path_sums);
        if bsdf.is_delta() {
            return None;
        }
        if technique == Technique::Splat {
            let end = self.walk.light_end(light, vertex);
            let LensSample { position, ray, light } = self.walk.splat(&end, || numbers.lens(), |_| 0.0)?;
            value.pixel = position;
            let part = self.part(position, segments, &light);
            lanes.shadows.push(Ray { tag: number as u32, ..ray }, part);
        } else {
            (lanes.end_rays[number], lanes.end_hits[number]) = (*ray, *hit);
        }
        None
    }

    /// Camera subpaths, and the techniques at their ends.
    fn trace_cameras<'p>(
        &self,
        lanes: &mut Lanes,
        lane: &impl Fn(usize) -> Lane<'p>,
        values: &mut [Value],
        counters: &mut Counters,
    ) {
        let mut active = 0;
        for (number, value) in values.iter_mut().enumerate().take(LANES) {
            let Lane { technique, point, .. } = lane(number);
            let is_alone = matches!(technique, Technique::Hit | Technique::LightSample);
            if is_alone || technique != Technique::Splat && lanes.end_hits[number].is_some() {
                let (raster, pixel) = self.raster(&point);
                value.pixel = pixel;
                let (subpath, ray) = self.walk.start_at_camera(raster, point.lens());
                lanes.cameras[number] = subpath;
                lanes.rays[active] = Ray { tag: number as u32, ..ray };
                active += 1;
            }
        }
        let numbers = |lanes: &Lanes, tag: u32| lane(tag as usize).of_camera(lanes);
        self.advance((lanes, active), counters, numbers, |lanes, end, counters| {
            let lane = lane(end.0.tag as usize);
            self.camera_step(&lane, lanes, end, &mut values[lane.number], counters)
        });
    }

    fn camera_step(
        &self,
        lane: &Lane,
        lanes: &mut Lanes,
        (ray, hit, shaded): (&Ray, &Hit, ShadedHit),
        value: &mut Value,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let Self { walk, .. } = self;
        let Lane { number, segments, technique, point: numbers } = *lane;
        let subpath = &mut lanes.cameras[number];
        let direction = Vec3::from(ray.direction);
        let is_last = subpath.segments == technique.subpaths(segments)[1];
        let is_hit = technique == Technique::Hit && is_last;
        if !hit.is_some() && is_hit {
            let seen = walk.escape(subpath, direction)?;
            value.radiance = self.part(value.pixel, segments, &seen).to_array();
        }
        let point = shaded.met.point()?;
        let (met, opacity) = ((ray, hit, &point), |n| numbers.opacity(n, false));
        if let Err(behind) = walk.stop(subpath, met, true, opacity, counters) {
            return behind;
        }
        if is_hit {
            let seen = walk.emission(subpath, &point, direction)?;
            value.radiance = self.part(value.pixel, segments, &seen).to_array();
            return None;
        }
        let bsdf = shaded.bsdf::<F>(walk.context.scene);
        let at = Scatterer { point: &point, bsdf: &bsdf };
        let vertex = walk.camera_vertex(subpath, at, direction, numbers.lens());
        if !is_last {
            let u = || numbers.scattering(subpath.segments, false);
            let sample = shaded.scattered(|| bsdf.sample::<F>(vertex.wo, u()))?;
            let throughput = Rgb::from(subpath.throughput) * sample.weight;
            return walk.scatter(subpath, &vertex, (&sample, at.towards(&sample)?), throughput, None);
        }
        if bsdf.is_delta() {
            return None;
        }
        let (shadow, light) = match technique {
            Technique::LightSample => {
                let sample = || walk.sample_light(&vertex, numbers.light_sample());
                let lit = shaded.lit(&walk.context, sample)?;
                let light = walk.light_sample(subpath, &vertex, &lit);
                light.is_some().then_some((lit.ray, light))?
            }
            _ => {
                let end = (&lanes.end_rays[number], &lanes.end_hits[number]);
                walk.connect((subpath, &vertex), &lanes.lights[number], end)?
            }
        };
        let part = self.part(value.pixel, segments, &light);
        lanes.shadows.push(Ray { tag: number as u32, ..shadow }, part);
        None
    }

    /// The part of chains of a technique's light, times the number of techniques.
    fn part(&self, pixel: u32, segments: u32, light: &Weighted) -> Rgb {
        let rest = 1.0 - self.split.of_paths(pixel, segments, light);
        light.radiance * (rest * Technique::count(segments) as f32)
    }

    /// The place in the picture of a camera subpath, and the position of its pixel in the film.
    fn raster(&self, point: &Point) -> (Vec2, u32) {
        let [width, height] = self.walk.size;
        let [u, v] = point.pixel();
        let raster = Vec2::new(u * width as f32, v * height as f32);
        let [x, y] = [(raster.x as u32).min(width - 1), (raster.y as u32).min(height - 1)];
        (raster, Tile::position(self.walk.size, x, y) as u32)
    }

    fn evaluate_paths<'p>(
        &self,
        lanes: &mut Lanes,
        point: impl Fn(usize) -> Point<'p>,
        values: &mut [Value],
        counters: &mut Counters,
    ) {
        let Lanes { paths, rays, hits, shadows, .. } = lanes;
        let count = values.len().min(LANES);
        for number in 0..count {
            let point = point(number);
            let (raster, pixel) = self.raster(&point);
            (paths[number], rays[number]) = self.paths.start(pixel, raster, &point);
            rays[number].tag = number as u32;
        }
        let numbers = |_: &Path, lane| point(lane as usize);
        self.paths.trace((paths, rays, hits), count, shadows, numbers, Part::Chains, counters);
        for (value, path) in values.iter_mut().zip(paths.iter()) {
            *value = Value { radiance: path.radiance, pixel: path.pixel };
        }
    }
}
