//! The bidirectional estimator of the textbook (Veach 1997, chapter 10): one path at a time, whose weights
//! come from the densities of all techniques, written down for the whole path in f64. It is what the running
//! sums of `walk/sums.rs` are tested against.
//!
//! The densities are a function of the path alone, whichever technique has found it. So weights that agree
//! with them add up to one.

use crate::bsdf::{All, Bsdf};
use crate::geometry::{Hit, MISS, Ray};
use crate::light::{EmissionSampler, LightType, emitted};
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::bidirectional::merge_photons::MergeRadii;
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::{Origin, SceneContext};
use crate::transport::walk::dimension;
use crate::transport::walk::light::{LightWalk, PATHS_PER_TASK};
use crate::transport::walk::sums::{Arrival, Counts};
use crate::transport::walk::techniques::lens_point;
use crate::transport::walk::termination::survive;
use crate::transport::walk::vertex::{Scatterer, is_bent_at};
use crate::{Level, Rgb};
use glam::Vec3;

mod densities;
mod light_path;

pub use densities::MOST_SEGMENTS;
use densities::{Light, Path, PathVertex};
use light_path::Recorder;
pub use light_path::{LightPath, StoredVertex};

/// Evaluates paths one at a time.
#[derive(Clone, Copy)]
pub struct Reference<'a> {
    context: SceneContext<'a, All>,
    emission: &'a EmissionSampler<'a>,
    settings: PathSettings,
    counts: Counts,
    merging: Option<MergeRadii>,
}

impl<'a> Reference<'a> {
    /// With the techniques of `counts`, for one task of light paths and for paths of up to [`MOST_SEGMENTS`]
    /// segments. Weights know of merges with radii `merging`; their photons are not gathered.
    pub fn new(
        context: SceneContext<'a, All>,
        emission: &'a EmissionSampler<'a>,
        settings: PathSettings,
        counts: Counts,
        merging: Option<MergeRadii>,
    ) -> Self {
        let settings = PathSettings { max_depth: settings.max_depth.min(MOST_SEGMENTS as u32), ..settings };
        let context = SceneContext::new(context.scene, &context.bvh, &context.lights, Level::BASELINE);
        Self { context, emission, settings, counts, merging }
    }

    /// Follows the light paths of a sample. Returns the number of vertices that are connected to cameras'.
    ///
    /// # Errors
    /// [`crate::memory::OutOfMemory`] where `scratch` has less than that of a light pass.
    pub fn light_paths(
        &self,
        sample: u32,
        scratch: &mut crate::memory::Arena,
        paths: &mut [LightPath],
        stored: &mut [StoredVertex],
    ) -> Result<usize, crate::memory::OutOfMemory> {
        let Self { context, emission, settings, counts, .. } = *self;
        paths.fill(LightPath::default());
        let mut recorder = Recorder { reference: self, paths, stored, count: 0 };
        let (count, max_depth) = ((counts.light_paths as u32).min(PATHS_PER_TASK as u32), settings.max_depth);
        let walk = LightWalk { context, emission, seed: settings.seed, paths: count, max_depth };
        walk.follow(0, sample, scratch, &mut recorder)?;
        Ok(recorder.count)
    }

    /// The splat of the `count`th vertex of a light path: its raster column and row, and its radiance.
    pub fn splat(&self, light: &LightPath, count: usize) -> Option<([u32; 2], Rgb)> {
        let Self { context, settings: PathSettings { width, height, max_depth, .. }, .. } = *self;
        if count == 1 || count as u32 + 1 > max_depth {
            return None;
        }
        let vertices = light.vertices.get(..count)?;
        let (end, before) = (vertices.last()?, light.before(count));
        let (point, bsdf) = self.seen_along(end, before.direction_to(end))?;
        let camera = &context.scene.camera;
        let lens = if camera.lens_radius > 0.0 { light.lens[count - 1] } else { [0.5; 2] };
        let seen = camera.project(width, height, point.position, lens)?;
        let raster = [seen.raster.x, seen.raster.y];
        if !(raster.iter().all(|&at| at >= 0.0) && raster[0] < width as f32 && raster[1] < height as f32) {
            return None;
        }
        let (to_camera, to_light) = (-seen.direction, -before.direction_to(end));
        let (wo, wi) = (point.frame.to_local(to_camera), point.frame.to_local(to_light));
        if !point.sides_agree(wo, to_camera) {
            return None;
        }
        let at = Scatterer { point: &point, bsdf: &bsdf };
        let value = at.scattering_from_light(&context, wo, wi).value;
        let path = Path::joined(light.light, vertices, &[], lens)?;
        let weight = self.weight(&path, count + 1);
        let cos = |direction: Vec3| direction.dot(point.geometric_normal).abs();
        let geometry = cos(to_camera) / cos(to_light) * seen.pdf / seen.distance / seen.distance;
        let pixels = width as f32 * height as f32;
        let radiance = light.power[count - 1] * value * (pixels * geometry * weight);
        let target = lens_point(camera, lens, point.position, &seen);
        let radiance = context.transmit(point.spawn_to(target), radiance, &mut 0)?;
        (radiance.max_element() > 0.0 && radiance.is_finite())
            .then_some((raster.map(|at| at as u32), radiance))
    }

    /// The light of sample `sample` of the pixel in column `x` and row `y`, without splats: by hits, light
    /// samples, and connections of each vertex with `connections` of the `stored` ones. `None` where a
    /// shading normal depends on the path's direction, or the path is too long.
    pub fn radiance(
        &self,
        [x, y]: [u32; 2],
        sample: u32,
        paths: &[LightPath],
        (stored, connections): (&[StoredVertex], u32),
    ) -> Option<Rgb> {
        let Self { context, settings: PathSettings { width, height, seed, max_depth }, .. } = *self;
        let sampler = Sampler::new(seed, y * width + x, sample);
        let ([dx, dy], lens) = (sampler.pair(dimension::PIXEL), sampler.pair(dimension::LENS));
        let mut ray = context.scene.camera.ray(width, height, x as f32 + dx, y as f32 + dy, lens);
        let (mut radiance, mut throughput, mut eta_squared) = (Rgb::ZERO, Rgb::ONE, 1.0);
        // The vertices so far, from the lens on.
        let mut vertices = [PathVertex::default(); MOST_SEGMENTS];
        let (mut origin, mut segments) = (Origin { triangle: MISS, crossings: 0 }, 1);
        loop {
            let direction = Vec3::from(ray.direction);
            let hit = context.nearest(&ray);
            let before = &vertices[..segments as usize - 1];
            let weight_of_hit = |light: Light| {
                Path::joined(light, &[], before, lens).map_or(0.0, |path| self.weight(&path, 0))
            };
            if !hit.is_some() {
                let light = Light::far(context.lights.environment_index(), direction);
                let sky = context.scene.environment.map(|sky| sky.radiance(context.scene, direction));
                radiance += throughput * sky.unwrap_or_default() * weight_of_hit(light);
                break;
            }
            let Some(point) = context.surface_at(&ray, &hit) else { break };
            let opacity = |crossings| sampler.single(dimension::opacity(segments, crossings));
            let met = (&ray, &hit, &point);
            let mut passed = [1.0; 3];
            let state = (&mut origin, &mut passed);
            let stopped = context.stop(state, met, segments == 1, opacity, &mut Counters::default());
            throughput *= Rgb::from(passed);
            match stopped {
                Ok(()) => {}
                Err(None) => break,
                Err(Some(behind)) => {
                    ray = behind;
                    continue;
                }
            }
            let seen = emitted(context.scene, hit.triangle, &point.attributes, point.front);
            if seen != Rgb::ZERO {
                let index = context.lights.emitter_index(hit.triangle).unwrap_or(0);
                radiance += throughput * seen * weight_of_hit(Light::near(index, point.position));
            }
            if segments >= max_depth {
                break;
            }
            let (bsdf, wo) = (context.bsdf_at(&point), point.frame.to_local(-direction));
            if is_bent_at(&point, -direction) {
                return None;
            }
            vertices[segments as usize - 1] = PathVertex::at(&point, &hit);
            let here = Here { point: &point, bsdf: &bsdf, wo, throughput, lens };
            if !bsdf.is_delta() {
                let before = &vertices[..segments as usize];
                radiance += self.light_sample(&here, &sampler, before);
                radiance += self.connections(&here, &sampler, before, paths, (stored, connections));
            }

            let at = Scatterer { point: &point, bsdf: &bsdf };
            let u = dimension::bsdf_sample(&sampler, segments);
            let Some((sample, towards)) = at.sample::<All>(direction, u) else { break };
            throughput *= sample.weight;
            eta_squared *= sample.eta * sample.eta;
            let roulette = || sampler.single(dimension::vertex(segments) + dimension::ROULETTE);
            let Some(survival) = survive(segments, throughput * eta_squared, roulette) else { break };
            throughput /= survival;
            vertices[segments as usize - 1].leave(&sample, 1.0 / sample.eta);
            (ray, origin.triangle, segments) = (point.spawn(towards), hit.triangle, segments + 1);
        }
        Some(radiance)
    }

    fn light_sample(&self, here: &Here, sampler: &Sampler, vertices: &[PathVertex]) -> Rgb {
        let Self { context, .. } = self;
        let Here { point, bsdf, wo, throughput, lens } = *here;
        let u = dimension::light_sample(sampler, vertices.len() as u32);
        let normal = Scatterer { point, bsdf }.normal_for_lights();
        let Some(light) = context.lights.sample(context.scene, point.position, normal, u) else {
            return Rgb::ZERO;
        };
        let wi = point.frame.to_local(light.direction);
        let (value, _) = bsdf.evaluate::<All>(wo, wi);
        if !point.sides_agree(wi, light.direction) || value == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let end = match light.target {
            Some(target) => Light::near(light.light, target.position),
            None => Light::far(light.light, light.direction),
        };
        let weight = Path::joined(end, &[], vertices, lens).map_or(0.0, |path| self.weight(&path, 1));
        let arrives = throughput * value * light.radiance * (weight / light.pdf);
        let arrives =
            context.shadow_ray(point, &light).and_then(|ray| context.transmit(ray, arrives, &mut 0));
        arrives.filter(|light| light.is_finite()).unwrap_or_default()
    }

    fn connections(
        &self,
        here: &Here,
        sampler: &Sampler,
        vertices: &[PathVertex],
        paths: &[LightPath],
        (stored, count): (&[StoredVertex], u32),
    ) -> Rgb {
        let random = sampler.single(dimension::CONNECTION + vertices.len() as u32);
        let one = |part: u32| {
            let at = ((part as f32 + random) / count as f32).min(crate::sampling::ONE_MINUS_EPSILON);
            let (path, end) = *stored.get((at * stored.len() as f32) as usize)?;
            self.connection(here, vertices, paths.get(path)?, end)
        };
        let sum: Rgb = (0..count).filter_map(one).sum();
        sum * (stored.len() as f32 / count.max(1) as f32)
    }

    /// The connection of the camera's `vertices` with the `count`th vertex of a light path.
    fn connection(
        &self,
        here: &Here,
        vertices: &[PathVertex],
        light: &LightPath,
        count: usize,
    ) -> Option<Rgb> {
        let Self { context, settings, .. } = self;
        if (vertices.len() + count + 1) as u32 > settings.max_depth {
            return None;
        }
        let Here { point, bsdf, wo, throughput, lens } = *here;
        let (end, before) = (light.vertices.get(count - 1)?, light.before(count));
        let (other, other_bsdf) = self.seen_along(end, before.direction_to(end))?;
        let to_light = (other.position - point.position).try_normalize()?;
        let (wi, out) = (point.frame.to_local(to_light), other.frame.to_local(-to_light));
        let back = -before.direction_to(end);
        if !(point.sides_agree(wi, to_light) && other.sides_agree(out, -to_light)) {
            return None;
        }
        let at_camera = Scatterer { point, bsdf }.scattering(context, wo, wi).value;
        let at = Scatterer { point: &other, bsdf: &other_bsdf };
        let at_light = at.scattering_from_light(context, out, other.frame.to_local(back)).value;
        let path = Path::joined(light.light, &light.vertices[..count], vertices, lens)?;
        let weight = self.weight(&path, count + 1);
        let cos = |direction: Vec3| direction.dot(other.geometric_normal).abs();
        let geometry = cos(to_light) / cos(back) / other.position.distance_squared(point.position);
        let arrives = throughput * at_camera * light.power[count - 1] * at_light * (geometry * weight);
        let target = other.spawn(-to_light).origin;
        context.transmit(point.spawn_to(target.into()), arrives, &mut 0).filter(|light| light.is_finite())
    }
}

/// The end of a camera subpath.
struct Here<'h> {
    point: &'h SurfacePoint<'h>,
    bsdf: &'h Bsdf,
    wo: Vec3,
    throughput: Rgb,
    lens: [f32; 2],
}

impl<'a> Reference<'a> {
    /// The surface at `vertex` as a subpath sees it that comes in `direction`.
    fn seen_along(&self, vertex: &PathVertex, direction: Vec3) -> Option<(SurfacePoint<'a>, Bsdf)> {
        let PathVertex { position, triangle, barycentric: [u, v], .. } = *vertex;
        let ray = Ray::new(position - direction, direction);
        let point = self.context.surface_at(&ray, &Hit { t: 1.0, u, v, triangle })?;
        let bsdf = self.context.bsdf_at(&point);
        Some((point, bsdf))
    }

    /// Kind of light `index` in MIS.
    fn kind(&self, index: u32) -> LightType {
        self.emission.light_type(&self.context.lights, index)
    }

    /// η at a vertex, and the way by which light comes there from one that is a caster if `from_caster`.
    fn merge(
        &self,
        (point, bsdf): (&SurfacePoint, &Bsdf),
        squared: f64,
        from_caster: bool,
    ) -> (f64, Option<Arrival>) {
        let eta_vcm = self.merging.map_or(0.0, |radii| radii.eta_vcm(bsdf, point.position));
        let arrival = if eta_vcm > 0.0 { Arrival::of(from_caster, squared as f32, eta_vcm) } else { None };
        (f64::from(eta_vcm), arrival)
    }
}
