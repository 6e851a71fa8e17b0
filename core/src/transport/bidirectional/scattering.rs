//! Scattering of a camera path at a vertex: the next ray, and the MIS sums behind the vertex.

use crate::Rgb;
use crate::bsdf::{BsdfSample, Features};
use crate::geometry::{Hit, Ray};
use crate::transport::bidirectional::camera_path::{CameraPath, Vertex};
use crate::transport::bidirectional::camera_paths::CameraPaths;
use crate::transport::bidirectional::mis::Sums;
use crate::transport::bidirectional::shaded::Next;
use crate::transport::bidirectional::vertex::{normal_for_lights, reverse_pdf};
use crate::transport::settings::Counters;
use crate::transport::walk::dimension;
use crate::transport::walk::termination::{continuation_probability, is_cut};
use glam::Vec3;

impl<F: Features> CameraPaths<'_, F> {
    /// The path goes on where the BSDF sends it.
    pub(super) fn scatter(
        &self,
        path: &mut CameraPath,
        vertex: &Vertex,
        hit: &Hit,
        direction: Vec3,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let Vertex { point, bsdf, .. } = *vertex;
        let Next { ray, sample, throughput, eta_squared, is_cut } = match &vertex.shaded {
            Some(shaded) => shaded.next()?,
            None => self.next(path, vertex)?,
        };
        if is_cut {
            counters.dropped.unfinished += 1;
            return None;
        }
        path.eta_squared = eta_squared;
        path.sums = self.leave(vertex, &sample, (direction, ray.direction.into()));
        path.eta_vcm = if sample.delta { 0.0 } else { vertex.eta_vcm };
        path.has_rough |= u32::from(!bsdf.is_caustic_caster() && !sample.delta);
        if sample.delta {
            path.history = path.history.by_coat();
        }
        path.throughput = throughput;
        path.pdf = if sample.delta { f32::INFINITY } else { sample.pdf };
        path.position = point.position.to_array();
        path.normal = normal_for_lights(point, bsdf).to_array();
        path.triangle = hit.triangle;
        path.segments += 1;
        Some(ray)
    }

    /// The next ray of a path, without lanes.
    fn next(&self, path: &CameraPath, vertex: &Vertex) -> Option<Next> {
        let Vertex { point, bsdf, wo, sampler, .. } = *vertex;
        let [u, v] = dimension::scattering(&sampler, path.segments);
        let first = dimension::vertex(path.segments);
        let lobe = sampler.single(first + dimension::LOBE);
        let sample = bsdf.sample::<F>(wo, [u, v, lobe])?;
        let towards = point.frame.to_world(sample.direction);
        if !point.sides_agree(sample.direction, towards) {
            return None;
        }
        let mut throughput = Rgb::from(path.throughput) * sample.weight;
        let eta_squared = path.eta_squared * (sample.eta * sample.eta);
        let probability = continuation_probability(path.segments, throughput * eta_squared);
        if probability < 1.0 {
            if sampler.single(first + dimension::ROULETTE) >= probability {
                return None;
            }
            throughput /= probability;
        }
        if throughput == Rgb::ZERO {
            return None;
        }
        Some(Next {
            ray: point.spawn(towards),
            throughput: throughput.to_array(),
            eta_squared,
            is_cut: is_cut(path.segments, bsdf, &sample),
            sample,
        })
    }

    /// Sums after scattering at `vertex`.
    fn leave(&self, vertex: &Vertex, sample: &BsdfSample, (from, towards): (Vec3, Vec3)) -> Sums {
        let Vertex { point, bsdf, wo, sums, eta_vcm, is_bent, .. } = *vertex;
        if is_bent {
            return Sums::default();
        }
        let cos_in = from.dot(point.geometric_normal).abs();
        if sample.delta {
            return sums.with_merge().scatter_delta(cos_in, sample.eta);
        }
        let cos_out = towards.dot(point.geometric_normal).abs();
        let reverse = reverse_pdf(&self.context, (point, bsdf), wo, sample.direction);
        let eta_vcm = (!bsdf.is_caustic_caster()).then_some(eta_vcm);
        sums.scatter(&self.counts, sample.pdf, reverse, cos_out, eta_vcm)
    }
}
