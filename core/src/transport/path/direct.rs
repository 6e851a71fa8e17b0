//! Next-event estimation: light samples of a vertex, weighted against BSDF sampling by the power heuristic
//! (Veach 1997, chapter 9).

use super::PathIntegrator;
use super::shade::{Known, Vertex};
use super::shadow_rays::{Shadows, TO_ENVIRONMENT};
use crate::Rgb;
use crate::bsdf::Features;
use crate::geometry::Ray;
use crate::light::LightSample;
use crate::transport::caustics::merge::ChainLink;
use crate::transport::estimator::{dimension, environment_heuristic, power_heuristic};
use crate::transport::path::reuse::ReuseState;
use crate::transport::path::state::PathState;
use crate::transport::walk::visibility::shadow_ray;
use glam::Vec3;

impl<F: Features> PathIntegrator<'_, F> {
    /// Takes light samples at `vertex`, and puts their shadow rays into the queue.
    #[inline]
    pub(super) fn direct(
        &self,
        path: &PathState,
        exchange: &mut ReuseState,
        vertex: &Vertex,
        known: &Known,
        shadows: &mut Shadows,
    ) {
        let is_left = !known.said.is_lit || vertex.apart;
        if self.context.lights.is_empty() || vertex.bsdf.is_delta() || !is_left {
            return;
        }
        let (point, normal) = (vertex.point, vertex.normal);
        // A visibility table is of one side.
        let table = if normal == Vec3::ZERO {
            None
        } else {
            self.context.lights.visibility(point.position, point.frame.normal)
        };
        for part in 0..known.points {
            let is_several = known.points > 1;
            let sampler = if is_several { path.part(self.settings.seed, part) } else { vertex.sampler };
            let [u, v] = sampler.pair(vertex.first + dimension::LIGHT);
            let aim = table.map(|table| table.warp([u, v]));
            let choice = if self.context.lights.have_choice() {
                sampler.single(vertex.first + dimension::LIGHT_CHOICE)
            } else {
                0.0
            };
            let sample = self.context.lights.sample_deferred(
                self.context.scene,
                point.position,
                normal,
                [u, v, choice],
                aim,
            );
            if let Some((sample, later)) = sample
                && let Some((shadow, light)) =
                    self.light_contribution(path, exchange, vertex, known, (&sample, later))
            {
                shadows.push(shadow, light);
            }
        }
    }

    /// The shadow ray of a light sample, and the light that it brings to the camera if nothing is in its way. The
    /// radiance of the environment is looked up `later`.
    #[inline]
    fn light_contribution(
        &self,
        path: &PathState,
        exchange: &mut ReuseState,
        vertex: &Vertex,
        known: &Known,
        (sample, later): (&LightSample, bool),
    ) -> Option<(Ray, Rgb)> {
        let Vertex { point, ref bsdf, wo, apart, throughput, .. } = *vertex;
        let wi = point.frame.to_local(sample.direction);
        if !point.sides_agree(wi, sample.direction) {
            return None;
        }
        let ([(mut f, pdf), coat], is_rough) = match apart {
            true => (bsdf.evaluate_apart::<F>(wo, wi), true),
            false => ([bsdf.evaluate::<F>(wo, wi), (Rgb::ZERO, 0.0)], bsdf.is_receiver()),
        };
        if apart && known.said.is_lit {
            f = Rgb::ZERO;
        }
        if f == Rgb::ZERO && coat.0 == Rgb::ZERO {
            return None;
        }
        let shadow = shadow_ray(point, sample)?;
        let alone = sample.delta || known.ends;
        let each = 1.0 / known.points as f32;
        let weigh = |pdf: f32| match alone {
            true => each,
            false if later => each * environment_heuristic(self.context.lights, sample.pdf, each * pdf),
            false => each * power_heuristic(sample.pdf, each * pdf),
        };
        let mut weight = weigh(pdf);
        if let Some(merging) = &self.merging
            && !is_rough
            && merging.may_come_by(bsdf, path.chain)
        {
            let there = ChainLink { point, bsdf, near: wo, far: wi, coat_alone: false };
            let to_light = there.reverse(&self.context) / sample.pdf;
            weight = merging.beside_photons(weight, path.chain.abs() * to_light, || {
                merging.emission.density_of_sample(
                    self.context.scene,
                    self.context.lights,
                    sample,
                    point.position,
                )
            });
        }
        let of_base = f * weight;
        let contribution = if apart {
            let both = of_base + coat.0 * weigh(coat.1);
            if self.settings.reuse && exchange.is_lit() {
                exchange.light_is_of_base(Rgb::select(both.cmpgt(of_base), of_base / both, Rgb::ONE));
            }
            throughput * both * sample.radiance / sample.pdf
        } else {
            if self.settings.reuse && exchange.is_lit() {
                exchange.light_is_of_base(bsdf.base_part(wo, wi, f));
            }
            throughput * f * sample.radiance * (weight / sample.pdf)
        };
        let tag = vertex.ray.tag | if later { TO_ENVIRONMENT } else { 0 };
        Some((Ray { tag, ..shadow }, contribution))
    }
}
