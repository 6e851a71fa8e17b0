//! Path tracing of one path and one ray at a time, in the order of the theory. Pixels of it are what
//! `path/mod.rs` is tested against (`reference.rs`).

use crate::bsdf::{All, Bsdf, Diffuse};
use crate::bvh::Bvh;
use crate::geometry::Ray;
use crate::light::{LightSampler, emitted};
use crate::sampling::Sampler;
use crate::scene::{Scene, SurfacePoint};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::mis::{environment_heuristic, power_heuristic};
use crate::transport::walk::termination::{MAX_CROSSINGS, MAX_VERTICES, is_cut, survive};
use crate::transport::walk::vertex::Scatterer;
use crate::{Level, Rgb};
use core::f32::consts::PI;
use glam::Vec3;

/// Irradiance estimate in W/m² at `point`, on the side of its normal, by one path: π times the radiance that
/// a white diffuse surface would reflect. Each `sampler` gives an independent estimate.
pub fn irradiance(
    scene: &Scene,
    bvh: &Bvh,
    lights: &LightSampler,
    max_depth: u32,
    sampler: &Sampler,
    point: &SurfacePoint,
) -> Rgb {
    let context = SceneContext::<All>::new(scene, bvh, lights, Level::BASELINE);
    let (white, wo) = (Bsdf::Diffuse(Diffuse { reflectance: Rgb::ONE }), Vec3::Z);
    let direct = match lights.is_empty() || max_depth < 2 {
        true => Rgb::ZERO,
        false => direct_at_start(&context, point, &white, wo, dimension::light_sample(sampler, 1)),
    };
    let [u, v] = dimension::scattering(sampler, 1);
    let Some(scattered) = white.sample::<All>(wo, [u, v, 0.0]) else { return direct * PI };
    let direction = point.frame.to_world(scattered.direction);
    if max_depth < 2 || !point.sides_agree(scattered.direction, direction) {
        return direct * PI;
    }
    let start = Start {
        ray: point.spawn(direction),
        from: point.position,
        normal: point.frame.normal,
        pdf: scattered.pdf,
        triangle: point.triangle,
        segments: 2,
    };
    follow(&context, sampler, max_depth, false, (start, direct)) * PI
}

/// All delta lights at `point` if they are few, and a sample of the other lights by `u`; or a sample of all.
fn direct_at_start(
    context: &SceneContext<All>,
    point: &SurfacePoint,
    bsdf: &Bsdf,
    wo: Vec3,
    u: [f32; 3],
) -> Rgb {
    let (scene, lights) = (context.scene, context.lights);
    let count = lights.few_delta_lights();
    if count == 0 {
        return light_sample(context, point, bsdf, wo, u, Rgb::ONE);
    }
    let mut direct = Rgb::ZERO;
    for light in (0..count).filter_map(|index| lights.delta_light(scene, index, point.position)) {
        let wi = point.frame.to_local(light.direction);
        let (f, _) = bsdf.evaluate::<All>(wo, wi);
        if point.sides_agree(wi, light.direction) && f != Rgb::ZERO {
            let ray = context.shadow_ray(point, &light);
            let arriving = ray.and_then(|ray| context.transmit(ray, f * light.radiance, &mut 0));
            direct += arriving.unwrap_or_default();
        }
    }
    let mut others = *context;
    others.lights = lights.without_delta_lights();
    if others.lights.is_empty() {
        return direct;
    }
    let left = Rgb::splat(others.lights.fraction_left(point.position, point.frame.normal));
    direct + light_sample(&others, point, bsdf, wo, u, left)
}

/// Ray of a path, and the vertex at its origin.
pub(super) struct Start {
    pub(super) ray: Ray,
    pub(super) from: Vec3,
    /// Shading normal at `from`; zero if the surface transmits.
    pub(super) normal: Vec3,
    /// Solid-angle pdf of the ray's direction; infinite if no other technique can sample it.
    pub(super) pdf: f32,
    pub(super) triangle: u32,
    /// Segment number of the ray.
    pub(super) segments: u32,
}

impl Start {
    /// Radiance of the environment and its MIS weight.
    fn escape(&self, context: &SceneContext<All>, direction: Vec3) -> (Rgb, f32) {
        let (scene, lights) = (context.scene, &context.lights);
        let Some(environment) = &scene.environment else { return (Rgb::ZERO, 0.0) };
        let seen = environment.radiance(scene, direction);
        if seen == Rgb::ZERO {
            return (seen, 0.0);
        }
        let light_pdf = lights.pdf_escape(scene, self.from, self.normal, direction);
        let is_alone = self.pdf == f32::INFINITY;
        (seen, if is_alone { 1.0 } else { environment_heuristic(lights, self.pdf, light_pdf) })
    }

    /// Emission of the surface at `point` and its MIS weight.
    fn emission(&self, context: &SceneContext<All>, point: &SurfacePoint, direction: Vec3) -> (Rgb, f32) {
        let (scene, lights) = (context.scene, &context.lights);
        let seen = emitted(scene, point.triangle, &point.attributes, point.front);
        if seen == Rgb::ZERO {
            return (seen, 0.0);
        }
        let distance = self.from.distance(point.position);
        let light_pdf = lights.pdf_hit(scene, self.from, self.normal, point.triangle, distance, direction);
        (seen, if self.pdf == f32::INFINITY { 1.0 } else { power_heuristic(self.pdf, light_pdf) })
    }
}

/// `found` and the radiance along the ray of `start`; if `is_on_silhouette`, without emission of the first
/// surface.
pub(super) fn follow(
    context: &SceneContext<All>,
    sampler: &Sampler,
    max_depth: u32,
    is_on_silhouette: bool,
    (mut start, found): (Start, Rgb),
) -> Rgb {
    let (mut radiance, mut throughput) = (found, Rgb::ONE); // L, β
    let (mut eta_squared, mut crossings) = (1.0, 0);
    while start.segments <= MAX_VERTICES && crossings <= MAX_CROSSINGS {
        let (ray, segments) = (start.ray, start.segments);
        let direction = Vec3::from(ray.direction);
        let hit = context.nearest(&ray);
        if !hit.is_some() {
            let (seen, weight) = start.escape(context, direction);
            radiance += throughput * seen * weight;
            break;
        }
        let Some(point) = context.surface_at(&ray, &hit) else { break };

        // Skipped surface: by rounding, or a cut-out or pane.
        let opacity = || sampler.single(dimension::opacity(segments, crossings));
        let is_left = segments == 1 && point.is_left_by(&ray);
        let passed = || context.passed(&point, (&ray, &hit), start.triangle, opacity);
        if let Some(factor) = is_left.then_some(Rgb::ONE).or_else(passed) {
            throughput *= factor;
            (start.ray, start.triangle) = (point.spawn(direction), hit.triangle);
            crossings += 1;
            continue;
        }
        if !(is_on_silhouette && segments == 1) {
            let (seen, weight) = start.emission(context, &point, direction);
            radiance += throughput * seen * weight;
        }
        if segments >= max_depth {
            break;
        }

        let bsdf = context.bsdf_at(&point);
        let wo = point.frame.to_local(-direction);
        if !bsdf.is_delta() && !context.lights.is_empty() {
            let u = dimension::light_sample(sampler, segments);
            radiance += light_sample(context, &point, &bsdf, wo, u, throughput);
        }

        // BSDF sampling.
        let u = dimension::bsdf_sample(sampler, segments);
        let at = Scatterer { point: &point, bsdf: &bsdf };
        let Some((scattered, direction)) = at.sample::<All>(direction, u) else { break };
        throughput *= scattered.weight;
        eta_squared *= scattered.eta * scattered.eta;

        // Russian roulette.
        let roulette = || sampler.single(dimension::vertex(segments) + dimension::ROULETTE);
        let Some(survival) = survive(segments, throughput * eta_squared, roulette) else { break };
        throughput /= survival;
        if throughput == Rgb::ZERO || is_cut(segments, &bsdf, &scattered) {
            break;
        }
        start = Start {
            ray: point.spawn(direction),
            from: point.position,
            normal: at.normal_for_lights(),
            pdf: if scattered.delta { f32::INFINITY } else { scattered.pdf },
            triangle: hit.triangle,
            segments: segments + 1,
        };
    }
    radiance
}

/// Next-event estimation at `point`: light sampled by `u` that `bsdf` scatters towards `wo`, times
/// `throughput`.
fn light_sample(
    context: &SceneContext<All>,
    point: &SurfacePoint,
    bsdf: &Bsdf,
    wo: Vec3,
    u: [f32; 3],
    throughput: Rgb,
) -> Rgb {
    let (scene, lights) = (context.scene, &context.lights);
    let normal = if bsdf.transmits() { Vec3::ZERO } else { point.frame.normal };
    let aim = lights.warp(point.position, normal, u);
    let Some((light, later)) = lights.sample_deferred(scene, point.position, normal, u, aim) else {
        return Rgb::ZERO;
    };
    let wi = point.frame.to_local(light.direction);
    let (f, pdf) = bsdf.evaluate::<All>(wo, wi);
    if !point.sides_agree(wi, light.direction) || f == Rgb::ZERO {
        return Rgb::ZERO;
    }
    let weight = match light.delta {
        true => 1.0,
        false if later => environment_heuristic(lights, light.pdf, pdf),
        false => power_heuristic(light.pdf, pdf),
    };
    let sent = throughput * f * light.radiance * (weight / light.pdf);
    let arriving = context.shadow_ray(point, &light).and_then(|ray| context.transmit(ray, sent, &mut 0));
    let environment = scene.environment.as_ref().filter(|_| later);
    let seen = environment.map_or(Rgb::ONE, |e| e.radiance(scene, light.direction));
    arriving.unwrap_or_default() * seen
}
