//! Next direction of a path: BSDF sampling, Russian roulette, and the MIS quantities of the next vertex.

use super::PathIntegrator;
use super::estimator::{LightEstimator, RemainingLight};
use super::shade::Path;
use super::sharing::Sharing;
use super::vertex::PathVertex;
use crate::Rgb;
use crate::bsdf::Features;
use crate::geometry::Ray;
use crate::transport::settings::Counters;
use crate::transport::walk::dimension;
use crate::transport::walk::termination::{continuation_probability, is_cut};

impl<F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'_, F, E, R> {
    /// Next ray of the path from `vertex`, if the path survives, to find the `rest` of the light.
    #[inline]
    pub(super) fn scatter(
        &self,
        Path { path, state, shared }: Path<E::State, R::State>,
        vertex: &PathVertex,
        rest: &RemainingLight,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let PathVertex { point, ref bsdf, ref sampler, wo, first, segments, apart, .. } = *vertex;
        let [u, v] = dimension::scattering(sampler, segments);
        let lobe = if F::GLOSSY || F::DIELECTRIC { sampler.single(first + dimension::LOBE) } else { 0.0 };
        let (sample, is_narrow) = match apart {
            true => bsdf.sample_apart::<F>(wo, [u, v, lobe])?,
            false => bsdf.sample::<F>(wo, [u, v, lobe]).map(|sample| (sample, sample.delta))?,
        };
        R::sample_bsdf(shared, || match is_narrow {
            true => Rgb::ZERO,
            false if apart => Rgb::ONE,
            false => bsdf.base_part(wo, sample.direction, sample.weight * sample.pdf),
        });
        path.components = if is_narrow { rest.narrow } else { rest.wide? };
        let mut throughput = vertex.throughput * sample.weight;
        let survives = R::leave(shared, (point, bsdf), throughput, segments);
        let direction = point.frame.to_world(sample.direction);
        if !point.sides_agree(sample.direction, direction) {
            return None;
        }
        path.eta_squared *= sample.eta * sample.eta;
        let pixel_throughput = R::throughput(shared, throughput) * path.eta_squared;
        let continuation_probability =
            if survives { 1.0 } else { continuation_probability(segments, pixel_throughput) };
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
        self.estimator.scattered(&self.context, vertex, state, (&sample, is_narrow));
        path.throughput = throughput.to_array();
        // MIS compares one BSDF sample with n light samples.
        path.pdf = if sample.delta { f32::INFINITY } else { sample.pdf / rest.light_samples as f32 };
        path.position = point.position.to_array();
        path.normal = vertex.normal.to_array();
        path.travelled = vertex.travelled;
        path.segments += 1;
        path.triangle = point.triangle;
        Some(point.spawn(direction))
    }
}
