//! Next-event estimation: light samples of a vertex, weighted against BSDF sampling by the power heuristic
//! (Veach 1997, chapter 9).

use super::PathIntegrator;
use super::estimator::{LightEstimator, PathVertex, RemainingLight};
use super::sharing::Sharing;
use crate::Rgb;
use crate::bsdf::Features;
use crate::geometry::Ray;
use crate::light::LightSample;
use crate::sampling::Sampler;
use crate::transport::walk::dimension;
use crate::transport::walk::mis::{environment_heuristic, power_heuristic};
use crate::transport::walk::shadow_tag::ShadowTag;
use crate::transport::wavefront::Wavefront;
use glam::Vec3;

impl<F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'_, F, E, R> {
    /// Takes light samples at `vertex` and queues their shadow rays.
    #[inline]
    pub(super) fn direct(
        &self,
        (state, shared): (&E::State, &mut R::State),
        vertex: &PathVertex,
        rest: &RemainingLight,
        wave: &mut Wavefront,
    ) {
        let (scene, lights) = (self.context.scene, &self.context.lights);
        let is_left = !rest.is_lit || vertex.apart;
        if lights.is_empty() || vertex.bsdf.is_delta() || !is_left {
            return;
        }
        let (point, normal) = (vertex.point, vertex.normal);
        // A visibility table holds for one side only.
        let table =
            if normal == Vec3::ZERO { None } else { lights.visibility(point.position, point.frame.normal) };
        for part in 0..rest.light_samples {
            let sampler = match rest.light_samples {
                1 => vertex.sampler,
                // The light samples of all paths of a pixel together form a net.
                count => {
                    let PathVertex { pixel, sample, .. } = *vertex;
                    let index = (sample >> 1).wrapping_mul(count).wrapping_add(part);
                    Sampler::replicate(self.settings.seed, pixel, sample & 1, index)
                }
            };
            let [u, v] = sampler.pair(vertex.first + dimension::LIGHT);
            let warped = table.map(|table| table.warp([u, v]));
            let choice = if lights.has_many_lights() {
                sampler.single(vertex.first + dimension::LIGHT_CHOICE)
            } else {
                0.0
            };
            let sample = lights.sample_deferred(scene, point.position, normal, [u, v, choice], warped);
            if let Some((sample, later)) = sample
                && let Some((ray, light)) =
                    self.light_contribution((state, &mut *shared), vertex, rest, (&sample, later))
            {
                let ShadowTag(tag) = ShadowTag::of_light_sample(vertex.path as u32, later);
                wave.shadows.push(Ray { tag, ..ray }, light);
            }
        }
    }

    /// Shadow ray of a light sample, and its unoccluded contribution to the pixel. With `later` the radiance
    /// of the environment is looked up after the shadow ray.
    #[inline]
    fn light_contribution(
        &self,
        (state, shared): (&E::State, &mut R::State),
        vertex: &PathVertex,
        rest: &RemainingLight,
        (sample, later): (&LightSample, bool),
    ) -> Option<(Ray, Rgb)> {
        let PathVertex { point, ref bsdf, wo, apart, throughput, .. } = *vertex;
        let wi = point.frame.to_local(sample.direction);
        if !point.sides_agree(wi, sample.direction) {
            return None;
        }
        let [(mut f, pdf), coat] = match apart {
            true => bsdf.evaluate_apart::<F>(wo, wi, rest.base_weight),
            false => [bsdf.evaluate::<F>(wo, wi), (Rgb::ZERO, 0.0)],
        };
        if apart && rest.is_lit {
            f = Rgb::ZERO;
        }
        if f == Rgb::ZERO && coat.0 == Rgb::ZERO {
            return None;
        }
        let ray = self.context.shadow_ray(point, sample)?;
        let alone = sample.delta || rest.ends && !apart;
        let each = 1.0 / rest.light_samples as f32;
        let weigh = |pdf: f32| match alone {
            true => each,
            false if later => each * environment_heuristic(&self.context.lights, sample.pdf, each * pdf),
            false => each * power_heuristic(sample.pdf, each * pdf),
        };
        let weight = self.estimator.weight_light(&self.context, vertex, state, (sample, wi), weigh(pdf));
        let of_base = f * weight;
        if apart {
            let both = of_base + coat.0 * weigh(coat.1);
            R::sample_light(shared, || Rgb::select(both.cmpgt(of_base), of_base / both, Rgb::ONE));
            return Some((ray, throughput * both * sample.radiance / sample.pdf));
        }
        R::sample_light(shared, || bsdf.base_part(wo, wi, f));
        Some((ray, throughput * f * sample.radiance * (weight / sample.pdf)))
    }
}
