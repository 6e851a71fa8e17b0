//! The path tracer of the textbook: one path at a time, one ray at a time. It is what
//! [`crate::transport::path`] is tested against, and it says in order what that does in pieces.

use super::silhouette::{self, is_outlined};
use crate::bsdf::All;
use crate::bvh::Bvh;
use crate::geometry::MISS;
use crate::light::{LightSampler, emitted};
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::transport::settings::PathSettings;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::mis::{environment_heuristic, power_heuristic};
use crate::transport::walk::termination::{MAX_CROSSINGS, MAX_VERTICES, continuation_probability, is_cut};
use crate::transport::walk::visibility::shadow_ray;
use crate::{Level, Rgb};
use glam::Vec3;

/// The radiance that sample number `sample` of the pixel in column `x` and row `y` sees.
pub fn radiance(
    scene: &Scene,
    bvh: &Bvh,
    lights: &LightSampler,
    settings: &PathSettings,
    [x, y]: [u32; 2],
    sample: u32,
) -> Rgb {
    let PathSettings { width, height, seed, max_depth, .. } = *settings;
    let context = SceneContext::<All>::new(scene, bvh, lights, Level::BASELINE);
    let sampler = Sampler::new(seed, y * width + x, sample);
    let [dx, dy] = sampler.pair(dimension::PIXEL);
    let lens = sampler.pair(dimension::LENS);
    let mut ray = scene.camera.ray(width, height, x as f32 + dx, y as f32 + dy, lens);

    // The border of a lamp is looked at by other rays.
    let is_outlined = is_outlined(scene, lights, settings, [x, y]);

    let mut radiance = Rgb::ZERO; // L
    let mut throughput = Rgb::ONE; // β
    let mut eta_squared = 1.0;
    // The vertex before: where it is, its normal, the density with which it chose the ray, its triangle.
    let (mut from, mut from_normal, mut pdf, mut left) = (Vec3::ZERO, Vec3::ZERO, f32::INFINITY, MISS);
    let (mut segments, mut crossings) = (1, 0);

    while segments <= MAX_VERTICES && crossings <= MAX_CROSSINGS {
        let direction = Vec3::from(ray.direction);
        let hit = context.nearest(&ray);

        // Light from infinitely far.
        if !hit.is_some() {
            if let Some(environment) = &scene.environment {
                let light_pdf = lights.pdf_escape(scene, from, from_normal, direction);
                let weight =
                    if pdf == f32::INFINITY { 1.0 } else { environment_heuristic(lights, pdf, light_pdf) };
                let seen = environment.radiance(scene, direction);
                radiance += throughput * seen * if seen == Rgb::ZERO { 0.0 } else { weight };
            }
            break;
        }
        let Some(point) = context.surface_at(&ray, &hit) else { break };

        // Rounding, or a hole in the surface: on in the same direction.
        let opacity = point.material.opacity.at::<All>(scene, point.uv);
        let met_again = hit.triangle == left || (segments == 1 && point.is_left_by(&ray));
        let transparent = point.material.has_cutout()
            && sampler.single(dimension::CROSSING + segments - 1 + crossings) >= opacity;
        if met_again || transparent {
            ray = point.spawn(direction);
            left = hit.triangle;
            crossings += 1;
            continue;
        }

        // Light from the surface itself.
        let seen = emitted(scene, hit.triangle, point.uv, point.front);
        if seen != Rgb::ZERO && !(is_outlined && segments == 1) {
            let distance = from.distance(point.position);
            let light_pdf = lights.pdf_hit(scene, from, from_normal, hit.triangle, distance, direction);
            let weight = if pdf == f32::INFINITY { 1.0 } else { power_heuristic(pdf, light_pdf) };
            radiance += throughput * seen * weight;
        }
        if segments >= max_depth {
            break;
        }

        let bsdf = context.bsdf_at(&point);
        let wo = point.frame.to_local(-direction);
        let normal = if bsdf.transmits() { Vec3::ZERO } else { point.frame.normal };
        let first = dimension::vertex(segments);

        // Next-event estimation: light that a shadow ray reaches.
        if !bsdf.is_delta() && !lights.is_empty() {
            let [u, v] = sampler.pair(first + dimension::LIGHT);
            let choice = sampler.single(first + dimension::LIGHT_CHOICE);
            let u = [u, v, choice];
            let aim = lights.warp(point.position, normal, u);
            if let Some((light, later)) = lights.sample_deferred(scene, point.position, normal, u, aim) {
                let wi = point.frame.to_local(light.direction);
                let (f, pdf) = bsdf.evaluate::<All>(wo, wi);
                let same_side = point.sides_agree(wi, light.direction);
                if same_side && f != Rgb::ZERO {
                    let weight = match light.delta {
                        true => 1.0,
                        false if later => environment_heuristic(lights, light.pdf, pdf),
                        false => power_heuristic(light.pdf, pdf),
                    };
                    let sent = throughput * f * light.radiance * (weight / light.pdf);
                    let arriving =
                        shadow_ray(&point, &light).and_then(|ray| context.transmit(ray, sent, &mut 0));
                    let environment = scene.environment.as_ref().filter(|_| later);
                    let seen = environment.map_or(Rgb::ONE, |e| e.radiance(scene, light.direction));
                    radiance += arriving.unwrap_or_default() * seen;
                }
            }
        }

        // The path goes on where the BSDF sends it.
        let [u, v] = dimension::scattering(&sampler, segments);
        let lobe = sampler.single(first + dimension::LOBE);
        let Some(scattered) = bsdf.sample::<All>(wo, [u, v, lobe]) else { break };
        let direction = point.frame.to_world(scattered.direction);
        if !point.sides_agree(scattered.direction, direction) {
            break;
        }
        throughput *= scattered.weight;
        eta_squared *= scattered.eta * scattered.eta;

        // Roulette.
        let continuation_probability = continuation_probability(segments, throughput * eta_squared);
        if continuation_probability < 1.0 {
            if sampler.single(first + dimension::ROULETTE) >= continuation_probability {
                break;
            }
            throughput /= continuation_probability;
        }
        if throughput == Rgb::ZERO || is_cut(segments, &bsdf, &scattered) {
            break;
        }
        pdf = if scattered.delta { f32::INFINITY } else { scattered.pdf };
        (from, from_normal, left) = (point.position, normal, hit.triangle);
        ray = point.spawn(direction);
        segments += 1;
    }
    let mut lamps = Rgb::ZERO;
    if is_outlined {
        for ray in silhouette::rays(scene, settings, [x, y], sample) {
            let hit = context.nearest(&ray);
            lamps += silhouette::emission(&context, ray, hit);
        }
    }
    radiance + lamps
}
