//! Gather rays of the irradiance cache: one ray per stratum of the hemisphere of a diffuse point, and the
//! record made from them.
//!
//! A gather ray finds the light that its hit reflects, by path tracing; light that its hit emits or mirrors
//! is direct light, which each path of the picture finds itself (`PathClasses`). All N² rays of a point
//! form one or several waves, in blocks of 8 × 8 strata for coherent traversal.

use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::cache::irradiance::{CellFlux, Hemisphere, Metric, Record, metric, validity, validity_with_lobe};
use crate::cache::radiance::PooledRecord;
use crate::geometry::{Frame, Hit, Ray};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::Sampler;
use crate::sampling::warp::cosine_hemisphere;
pub use crate::transport::cached::gather_point::GatherPoint;
use crate::transport::cached::lobe::CoefficientGathering;
use crate::transport::path::sharing::PathWave;
use crate::transport::path::{LightEstimator, PathIntegrator};
use crate::transport::settings::Counters;
use crate::transport::walk::dimension;
use crate::transport::wavefront::{PathState, WAVE};
use glam::Vec3;

/// Offset of the pixel numbers of gathers, beyond those of any picture.
pub(in crate::transport) const NO_PIXEL: u32 = 1 << 30;

/// Minimum strata along a side for packets. With fewer, the rays of a block diverge
/// (docs/decisions/photon-map.md#harmonic-mean).
const NARROW: usize = 64;

/// Settings of gathering.
#[derive(Clone, Copy)]
pub struct Gathering<'a> {
    /// Tables for the number of strata to gather.
    pub flux: &'a CellFlux<'a>,
    /// Error metric; its extent is limited to the side of the picture at the distance of the record.
    pub metric: metric::Settings,
    /// Minimum radius of a record, in pixels.
    pub least_pixels: f32,
}

/// Results of the gather rays per stratum.
pub(in crate::transport) struct HemisphereSamples<'m> {
    pub(in crate::transport) n: usize,
    pub(in crate::transport) radiance: &'m mut [[f32; 3]],
    /// Radiances that decide on the radii; empty if the metric does not limit them.
    limited: &'m mut [[f32; 3]],
    pub(in crate::transport) inverse_distance: &'m mut [f32],
    pub(in crate::transport) directions: &'m mut [[f32; 3]],
    /// Local normals of the hits; empty if neither the metric nor the coefficients need them.
    normals: &'m mut [[f32; 3]],
    /// Number of strata that see an emitter or the environment.
    shining: u32,
}

impl<'m> HemisphereSamples<'m> {
    pub(super) fn footprint(n: usize) -> Footprint {
        let strata = n.saturating_mul(n);
        let triples = Footprint::default().slice::<[f32; 3]>(strata);
        triples.and(triples).and(triples).and(triples).slice::<f32>(strata)
    }

    pub(super) fn new(
        n: usize,
        metric: Metric,
        needs_normals: bool,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let strata = n.saturating_mul(n);
        let strata_if = |is_needed| if is_needed { strata } else { 0 };
        Ok(Self {
            n,
            radiance: arena.slice(strata)?,
            inverse_distance: arena.slice(strata)?,
            directions: arena.slice(strata)?,
            limited: arena.slice(strata_if(metric.limits_radiance()))?,
            normals: arena.slice(strata_if(needs_normals || metric.takes_normals()))?,
            shining: 0,
        })
    }

    fn hemisphere(&self) -> Option<Hemisphere<'_>> {
        let hemisphere = Hemisphere::new(self.n, self.radiance, self.inverse_distance, self.directions)?;
        if self.normals.is_empty() { Some(hemisphere) } else { hemisphere.with_normals(self.normals) }
    }

    /// Hemisphere of limited radiances, if the metric limits them.
    fn limited(&mut self) -> Option<Hemisphere<'_>> {
        let hemisphere = Hemisphere::new(self.n, self.radiance, self.inverse_distance, self.directions)?;
        hemisphere.limited(self.limited)
    }
}

impl<F: Features> PathIntegrator<'_, F> {
    /// Scratch memory of [`PathIntegrator::gather`] with n × n strata.
    pub fn gather_scratch(n: usize) -> Footprint {
        Self::gather_scratch_with::<()>(n)
    }

    /// Scratch memory with an estimator.
    pub fn gather_scratch_with<E: LightEstimator<F>>(n: usize) -> Footprint {
        let wave = PathWave::<E::State, ()>::footprint(n.saturating_mul(n).min(WAVE));
        wave.and(HemisphereSamples::footprint(n))
    }
}

impl<F: Features, E: LightEstimator<F>> PathIntegrator<'_, F, E> {
    /// Gathers a record at `place`. Each `number` has different rays. `None` if the irradiance is not finite,
    /// which is counted as dropped.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PathIntegrator::gather_scratch_with`].
    pub fn gather(
        &self,
        place: &GatherPoint,
        number: u32,
        gathering: &Gathering,
        scratch: &mut Arena,
        counters: &mut Counters,
    ) -> Result<Option<Record>, OutOfMemory> {
        let found = self.gather_with(place, number, gathering, None, scratch, counters)?;
        Ok(found.map(|(record, _)| record))
    }

    /// [`PathIntegrator::gather`] with coefficients of the incident radiance, written to the registers beside
    /// their tables. The number of strata is that of the tables of `gathering`, and these have to agree.
    ///
    /// # Errors
    /// Those of [`PathIntegrator::gather`].
    #[inline(never)]
    pub fn gather_with(
        &self,
        place: &GatherPoint,
        number: u32,
        gathering: &Gathering,
        coefficients: Option<CoefficientGathering>,
        scratch: &mut Arena,
        counters: &mut Counters,
    ) -> Result<Option<(Record, PooledRecord)>, OutOfMemory> {
        let Gathering { flux, metric, least_pixels } = *gathering;
        let n = flux.n();
        let mut arena = scratch.scratch();
        let needs_normals = coefficients.as_ref().is_some_and(|of| of.tables.needs_normals());
        let mut strata = HemisphereSamples::new(n, metric.metric, needs_normals, &mut arena)?;
        let frame = Frame::from_normal(place.normal());
        let generate = |i| self.generate_gather_ray(place, &frame, (number, i), n);
        self.trace_strata(&frame, &mut strata, &mut arena, generate, counters)?;
        let variance = strata.hemisphere().map_or(0.0, |hemisphere| hemisphere.variance());
        let derivatives =
            strata.hemisphere().and_then(|h| metric.metric.derivatives(self.context.level, flux, &h));
        let Some(derivatives) = derivatives.filter(|found| found.irradiance.is_finite()) else {
            counters.dropped.nan += 1;
            return Ok(None);
        };
        let picture = place.pixel * libm::sqrtf(self.settings.width as f32 * self.settings.height as f32);
        let settings = metric::Settings { least: least_pixels * place.pixel, ..metric.within(picture) };
        let limited = strata.limited().and_then(|h| metric.metric.derivatives(self.context.level, flux, &h));
        let of_radii = limited.as_ref().unwrap_or(&derivatives);
        let edge_moment = strata.hemisphere().map_or(Rgb::ZERO, |hemisphere| hemisphere.edge_moment());
        let light = coefficients
            .and_then(|of| Some((of.tables.project(self.context.level, &strata.hemisphere()?)?, of)));
        let lobe = light.as_ref().and_then(|(light, of)| {
            self.leaving_light(place, (&frame, of), light, (edge_moment, &derivatives))
        });
        let reach = match lobe {
            Some(lobe) => validity_with_lobe(&settings, of_radii, &lobe),
            None => validity(&settings, of_radii),
        };
        let mut record = Record::new(place.position(), &frame, &derivatives, &reach);
        let luminance = derivatives.luminance();
        record.set_noise(if luminance > 0.0 { variance / (luminance * luminance) } else { 0.0 });
        record.shining = strata.shining as f32 / (n * n) as f32;
        record.set_edge_moment(edge_moment);
        self.find_boundary(&mut record, place, &frame, &strata, counters);
        self.add_overhangs(&mut record, place);
        let scales = (reach.gradient_scale, record.radii[0]);
        let pooled = light.and_then(|(light, of)| light.write(scales, of.registers));
        Ok(Some((record, pooled.unwrap_or_default())))
    }

    /// Traces the rays of all strata, and stores their light and their hits. `generate` returns the local
    /// direction of ray i, the ray, and its path, whose place is the stratum.
    pub(in crate::transport) fn trace_strata(
        &self,
        frame: &Frame,
        strata: &mut HemisphereSamples,
        arena: &mut Arena,
        generate: impl Fn(usize) -> (Vec3, Ray, PathState),
        counters: &mut Counters,
    ) -> Result<(), OutOfMemory> {
        let n = strata.n;
        let mut wave = PathWave::<E::State, ()>::new((n * n).min(WAVE), arena)?;
        let mut first = 0;
        while first < n * n {
            let count = (n * n - first).min(wave.wave.paths.len());
            for i in 0..count {
                let (direction, ray, path) = generate(first + i);
                if let Some(slot) = strata.directions.get_mut(path.place as usize) {
                    *slot = direction.to_array();
                }
                wave.wave.rays[i] = Ray { tag: i as u32, ..ray };
                wave.wave.paths[i] = path;
                wave.begin(i, 0);
            }
            counters.paths += count as u64;
            let coherence = if n >= NARROW { Coherence::Coherent } else { Coherence::Incoherent };
            wave.wave.trace(&self.context, count, coherence, counters);
            for (path, hit) in wave.wave.paths.iter().zip(&*wave.wave.hits).take(count) {
                self.store_hit(path.place as usize, hit, frame, strata);
            }
            self.trace_to_end(&mut wave, count, counters);
            for path in wave.wave.paths.iter().take(count) {
                if let Some(slot) = strata.radiance.get_mut(path.place as usize) {
                    *slot = path.radiance;
                }
            }
            first += count;
        }
        Ok(())
    }

    /// Local direction of ray `i` of gather `number` with n × n strata, the ray, and its path.
    fn generate_gather_ray(
        &self,
        place: &GatherPoint,
        frame: &Frame,
        (number, i): (u32, usize),
        n: usize,
    ) -> (Vec3, Ray, PathState) {
        let stratum = stratum(n, i);
        let (pixel, sample) = (NO_PIXEL | number, i as u32);
        let [u, v] = Sampler::new(self.settings.seed, pixel, sample).pair(dimension::PIXEL);
        let (row, column) = (stratum / n, stratum % n);
        let direction = cosine_hemisphere([(column as f32 + u) / n as f32, (row as f32 + v) / n as f32]);
        let ray = place.ray(frame.to_world(direction));
        (direction, ray, place.path(pixel, sample, stratum))
    }

    /// Stores distance, emission and normal of the hit of a stratum.
    fn store_hit(&self, stratum: usize, hit: &Hit, frame: &Frame, strata: &mut HemisphereSamples) {
        if let Some(slot) = strata.inverse_distance.get_mut(stratum) {
            *slot = 1.0 / hit.t;
        }
        let material = self.context.scene.mesh.material(hit.triangle);
        let shines = match material.and_then(|material| self.context.scene.materials.get(material as usize)) {
            Some(material) => material.emits(),
            None => self.context.scene.environment.is_some(),
        };
        strata.shining += u32::from(shines);
        if let Some(slot) = strata.normals.get_mut(stratum) {
            let [a, b, c] = self.context.scene.mesh.corners(hit.triangle);
            *slot = frame.to_local((b - a).cross(c - a).normalize_or_zero()).to_array();
        }
    }
}

/// Stratum of ray `i`, in blocks of 8 × 8 if `n` is a multiple of 8.
#[inline]
fn stratum(n: usize, i: usize) -> usize {
    if !n.is_multiple_of(8) {
        return i;
    }
    let (block, within) = (i / 64, i % 64);
    let (row, column) = (block / (n / 8) * 8 + within / 8, block % (n / 8) * 8 + within % 8);
    row * n + column
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    #[test]
    fn every_stratum_has_one_ray() {
        for n in [1, 5, 8, 16, 24] {
            let mut seen = vec![false; n * n];
            for i in 0..n * n {
                assert!(!core::mem::replace(&mut seen[stratum(n, i)], true));
            }
        }
    }
}
