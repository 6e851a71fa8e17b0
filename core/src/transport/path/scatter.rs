//! The next direction of a path: BSDF sampling, Russian roulette, and the quantities that the next vertex needs for
//! its weights.

use super::PathIntegrator;
use super::shade::{Known, Vertex};
use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::geometry::Ray;
use crate::transport::caustics::merge::ChainLink;
use crate::transport::estimator::{Counters, continuation_probability, dimension, is_cut};
use crate::transport::path::reuse::ReuseState;
use crate::transport::path::state::{Components, MergeState, PathState};

impl<F: Features> PathIntegrator<'_, F> {
    /// The ray by which the path goes on from `vertex`, if it does. `gathered`: photons have the light that the wide
    /// part of the surface reflects.
    #[inline]
    pub(super) fn scatter(
        &self,
        path: &mut PathState,
        exchange: &mut ReuseState,
        vertex: &Vertex,
        (known, gathered, merged): (&Known, bool, MergeState),
        counters: &mut Counters,
    ) -> Option<Ray> {
        let Vertex { point, ref bsdf, ref sampler, wo, first, segments, apart, .. } = *vertex;
        let [u, v] = dimension::scattering(sampler, segments);
        let lobe = if F::GLOSSY || F::DIELECTRIC { sampler.single(first + dimension::LOBE) } else { 0.0 };
        let (sample, is_narrow) = match apart {
            true => bsdf.sample_apart::<F>(wo, [u, v, lobe])?,
            false => bsdf.sample::<F>(wo, [u, v, lobe]).map(|sample| (sample, sample.delta))?,
        };
        // A narrow coat's reflection was not gathered.
        if gathered && !is_narrow {
            path.share = Components::EMITTED;
        }
        if self.settings.reuse && exchange.is_lit() {
            let f = sample.weight * sample.pdf;
            exchange.path_is_of_base(match is_narrow {
                true => Rgb::ZERO,
                false if apart => Rgb::ONE,
                false => bsdf.base_part(wo, sample.direction, f),
            });
        }
        if self.maps.is_some() {
            if known.said.is_all && !is_narrow {
                return None;
            }
            path.share = if is_narrow { known.said.mirrored } else { known.said.next };
        }
        let mut throughput = vertex.throughput * sample.weight;
        let is_diffuse = matches!(bsdf, Bsdf::Diffuse(_));
        let certain = self.settings.reuse && is_diffuse && exchange.leave(point, throughput, segments);
        let direction = point.frame.to_world(sample.direction);
        if !point.sides_agree(sample.direction, direction) {
            return None;
        }
        path.eta_squared *= sample.eta * sample.eta;
        let worth = exchange.worth(throughput) * path.eta_squared;
        let continuation_probability = if certain { 1.0 } else { continuation_probability(segments, worth) };
        if continuation_probability < 1.0 {
            if sampler.single(first + dimension::ROULETTE) >= continuation_probability {
                return None;
            }
            throughput /= continuation_probability;
        }
        if throughput == Rgb::ZERO {
            return None;
        }
        if is_cut(segments, bsdf, &sample) {
            counters.dropped.unfinished += 1;
            return None;
        }
        self.update_merging(path, vertex, merged, (&sample, is_narrow));
        path.left_coat = u32::from(apart && is_narrow);
        path.throughput = throughput.to_array();
        // BSDF sampling has one sample beside n of the lights.
        path.pdf = if sample.delta { f32::INFINITY } else { sample.pdf / known.points as f32 };
        path.position = point.position.to_array();
        path.normal = vertex.normal.to_array();
        path.travelled = vertex.travelled;
        path.segments += 1;
        path.triangle = vertex.hit.triangle;
        Some(point.spawn(direction))
    }

    /// The partial ratio R of vertex merging behind `vertex`, which the path leaves by `sample` (`merge.rs`).
    #[inline]
    fn update_merging(
        &self,
        path: &mut PathState,
        vertex: &Vertex,
        merged: MergeState,
        (sample, is_narrow): (&BsdfSample, bool),
    ) {
        let Some(merging) = &self.merging else { return };
        let Vertex { point, ref bsdf, wo, apart, .. } = *vertex;
        let coat_alone = apart && is_narrow;
        let there = ChainLink { point, bsdf, near: wo, far: sample.direction, coat_alone };
        let is_rough = bsdf.is_receiver() && !is_narrow;
        if is_rough {
            (path.merged, path.disc) = (merged, merging.radius(point.position));
        }
        path.chain = match path.chain {
            _ if is_rough && merged != MergeState::NEVER => -merging.begun(point.position),
            _ if is_rough => 0.0,
            chain if !merging.may_come_by(bsdf, chain) => 0.0,
            0.0 => 0.0,
            chain if sample.delta => chain.abs() / (sample.eta * sample.eta),
            chain => chain.abs() * there.reverse(&self.context) / sample.pdf,
        };
    }
}
