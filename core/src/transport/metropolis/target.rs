//! Evaluation of points of primary sample space, a batch together: the light that each brings to a pixel.
//!
//! A point of multiplexed chains (Hachisuka et al. 2014) is one technique (s, t) of paths of one length,
//! which a random number chooses. Its light is the weighted contribution of the technique times the number of
//! techniques. A point of PSSMLT (Kelemen et al. 2002) is a whole path of path tracing.

use super::lane::Lane;
use super::lanes::{LANES, Lanes};
use super::numbers::{EmissionNumbers, PLACE_IN_PICTURE, Point, SLOTS_OF_PATH, Tail};
use super::numbers::{VertexNumbers, slots_of_technique};
use super::paths::{Part, Path, Paths};
use super::shading::{ShadedHit, Shading};
use super::split::{Contribution, MIN_SEGMENTS, Split};
use super::subpath::{Met, Subpath, Vertex, Walk};
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
use bytemuck::{Pod, Zeroable};
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

/// Kinds of points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PrimarySpace {
    /// One technique of a path of one length.
    #[default]
    Multiplexed,
    /// All light of a path from the camera.
    PathTracing,
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
    pub(super) space: PrimarySpace,
}

impl<'a, F: Features> Target<'a, F> {
    /// The part of chains of the light of a picture by `settings`, divided by `split`.
    pub fn new(
        context: SceneContext<'a, F>,
        emission: &'a EmissionSampler<'a>,
        settings: PathSettings,
        split: Split<'a>,
        space: PrimarySpace,
    ) -> Self {
        let PathSettings { width, height, .. } = settings;
        let walk = Walk::new(context, emission, [width, height]);
        Self { walk, paths: Paths::new(context, emission, settings, split), split, space }
    }

    /// Numbers of a point for paths of a length.
    pub(super) fn slots(&self, segments: u32) -> usize {
        match self.space {
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
                match self.space {
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
        if self.space == PrimarySpace::PathTracing {
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
        match self.space {
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
        if self.space == PrimarySpace::PathTracing {
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
        while active > 0 {
            counters.rays += active as u64;
            let (rays, hits) = (&lanes.rays[..active], &mut lanes.hits[..active]);
            self.walk.context.nearest_batch(rays, Coherence::Incoherent, hits);
            let mut left = 0;
            for i in 0..active {
                let traced = (&lanes.rays[..active], &lanes.hits[..active]);
                let of_tag = |tag| numbers(lanes, tag);
                let shaded = shading.hit(&self.walk.context, traced, i, of_tag);
                let (ray, hit) = (lanes.rays[i], lanes.hits[i]);
                if let Some(next) = step(lanes, (&ray, &hit, shaded), counters) {
                    lanes.rays[left] = Ray { tag: ray.tag, ..next };
                    left += 1;
                }
            }
            active = left;
        }
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
        let subpath = &mut lanes.lights[number];
        let opacity = |n| numbers.opacity(n, true);
        let point = match self.walk.meet(subpath, (ray, hit, shaded.met), false, opacity, counters) {
            Met::Surface(point) => point,
            Met::Passed(next) => return Some(next),
            Met::Nothing | Met::Lost => return None,
        };
        let vertex = self.walk.light_vertex(
            subpath,
            (point, shaded.bsdf::<F>(self.walk.context.scene)),
            ray.direction.into(),
        )?;
        if subpath.segments < technique.subpaths(segments)[0] {
            let u = || numbers.scattering(subpath.segments, true);
            let sample = shaded.scattered(|| vertex.bsdf.sample::<F>(vertex.wo, u()))?;
            return self.walk.scatter(subpath, &vertex, true, &sample);
        }
        self.walk.end(subpath, &vertex);
        if technique == Technique::Splat {
            let (pixel, shadow, contribution) = self.walk.splat(subpath, &vertex, numbers.lens())?;
            value.pixel = pixel;
            lanes.shadows.push(number as u32, shadow, self.part(pixel, segments, &contribution));
        } else if !vertex.bsdf.is_delta() {
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
        let Lane { number, segments, technique, point: numbers } = *lane;
        let subpath = &mut lanes.cameras[number];
        let direction = Vec3::from(ray.direction);
        let opacity = |n| numbers.opacity(n, false);
        let is_last = subpath.segments == technique.subpaths(segments)[1];
        let is_hit = technique == Technique::Hit && is_last;
        let point = match self.walk.meet(subpath, (ray, hit, shaded.met), true, opacity, counters) {
            Met::Surface(point) => point,
            Met::Passed(next) => return Some(next),
            Met::Nothing if is_hit => {
                let seen = self.walk.escape(subpath, direction)?;
                value.radiance = self.part(value.pixel, segments, &seen).to_array();
                return None;
            }
            Met::Nothing | Met::Lost => return None,
        };
        if is_hit {
            let seen = self.walk.emission(subpath, &point, direction)?;
            value.radiance = self.part(value.pixel, segments, &seen).to_array();
            return None;
        }
        let surface = (point, shaded.bsdf::<F>(self.walk.context.scene));
        let vertex = self.walk.camera_vertex(subpath, surface, direction, numbers.lens());
        if !is_last {
            let u = || numbers.scattering(subpath.segments, false);
            let sample = shaded.scattered(|| vertex.bsdf.sample::<F>(vertex.wo, u()))?;
            return self.walk.scatter(subpath, &vertex, false, &sample);
        }
        if vertex.bsdf.is_delta() {
            return None;
        }
        let (shadow, contribution) = match technique {
            Technique::LightSample => {
                let sample = || self.walk.sample_light(&vertex, numbers.light_sample());
                let lit = shaded.lit(&self.walk.context, sample)?;
                self.walk.light_sample(subpath, &vertex, lit)?
            }
            _ => {
                let (light, end) =
                    (&lanes.lights[number], (&lanes.end_rays[number], &lanes.end_hits[number]));
                self.connect((subpath, &vertex), light, end)?
            }
        };
        lanes.shadows.push(number as u32, shadow, self.part(value.pixel, segments, &contribution));
        None
    }

    /// The connection with a light subpath that has ended where its `ray` met `hit`.
    fn connect(
        &self,
        camera: (&Subpath, &Vertex),
        light: &Subpath,
        (ray, hit): (&Ray, &Hit),
    ) -> Option<(Ray, Contribution)> {
        let point = self.walk.context.surface_at(ray, hit)?;
        let surface = (point, self.walk.context.bsdf_at(&point));
        let other = self.walk.light_surface(surface, ray.direction.into())?;
        self.walk.connection(camera, (light, &other))
    }

    /// The part of chains of a technique's light, times the number of techniques.
    fn part(&self, pixel: u32, segments: u32, contribution: &Contribution) -> Rgb {
        let rest = 1.0 - self.split.of_paths(pixel, segments, contribution);
        contribution.radiance * (rest * Technique::count(segments) as f32)
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
