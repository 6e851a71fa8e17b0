//! One vertex of a path, in the order of the textbook: light that escapes to the environment, emission of the surface,
//! light that a structure knows, next-event estimation (`direct.rs`), the next direction (`scatter.rs`).

use super::shadow_rays::Shadows;
use super::{PathIntegrator, SurfaceInteraction};
use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::geometry::{Hit, Ray};
use crate::light::emitted;
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::estimator::{Counters, dimension, environment_heuristic, power_heuristic};
use crate::transport::path::reuse::ReuseState;
use crate::transport::path::state::{Components, MergeState, PathState};
use crate::transport::photon_mapping::final_gather::MapLookup;
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// Lights that fill a smaller share of a hemisphere, weighted by cosines, are found by shadow rays alone as well as with
/// the help of rays that find them by chance.
const SMALL: f32 = 0.1;

/// A vertex at which a path is scattered.
pub(super) struct Vertex<'v, 'a> {
    /// The ray that met it, and the triangle.
    pub(super) ray: &'v Ray,
    pub(super) hit: &'v Hit,
    pub(super) met: &'v SurfaceInteraction<'a>,
    pub(super) point: &'v SurfacePoint<'a>,
    pub(super) bsdf: Bsdf,
    /// The random numbers of the path, and the first dimension of this vertex.
    pub(super) sampler: Sampler,
    pub(super) first: u32,
    /// Segments of the path up to here.
    pub(super) segments: u32,
    /// Direction to the vertex before, local.
    pub(super) wo: Vec3,
    /// The normal as light sampling knows it: zero where light comes from both sides.
    pub(super) normal: Vec3,
    /// Distance from the vertex before, and from the camera.
    pub(super) distance: f32,
    pub(super) travelled: f32,
    /// β: throughput of the path up to here.
    pub(super) throughput: Rgb,
    /// Photons are those of its base alone; its coat is sampled apart.
    pub(super) apart: bool,
}

/// Light that structures know at a vertex, and the light that is left for the path to find.
pub(super) struct Known {
    /// A photon map's answer.
    pub(super) said: MapLookup,
    /// Light samples of next-event estimation.
    pub(super) points: u32,
    /// Next-event estimation is all that is left: the path ends here.
    pub(super) ends: bool,
}

impl<'a, F: Features> PathIntegrator<'a, F> {
    /// Shades the `hit` of `ray`, the last segment of `path`. The ray by which the path goes on.
    #[inline]
    pub(super) fn shade(
        &self,
        path: &mut PathState,
        exchange: &mut ReuseState,
        (ray, hit): (&Ray, &Hit),
        met: Option<&SurfaceInteraction<'a>>,
        shadows: &mut Shadows,
        counters: &mut Counters,
    ) -> Option<Ray> {
        if self.settings.reuse {
            exchange.go_behind(path);
        }
        if !hit.is_some() {
            self.escape(path, ray);
            return None;
        }
        let met = met?;
        let point = &met.point;
        let segments = u32::from(path.segments);
        let direction = Vec3::from(ray.direction);
        let sampler = Sampler::new(self.settings.seed, path.pixel, path.sample);

        // A camera on a surface does not see its back.
        let opacity = || sampler.single(dimension::CROSSING + u32::from(path.crossings));
        if segments == 1 && point.is_left_by(ray)
            || self.context.is_passed(point, hit, path.triangle, opacity)
        {
            return path.cross(point.spawn(direction), hit, counters);
        }
        self.emission(path, point, (ray, hit));
        if segments >= self.settings.max_depth {
            return None;
        }
        let bsdf = self.context.bsdf_at(point);
        if path.share.ends_at(&bsdf) {
            return None;
        }
        let came = path.share;
        path.share = came.behind(&bsdf);
        if self.settings.reuse {
            exchange.arrive(point, bsdf.cover(), path);
        }

        let near = if segments == 1 { self.context.scene.camera.eye } else { path.position.into() };
        let distance = near.distance(point.position);
        let has_photons = self.merging.is_some() || self.photons.is_some() || self.maps.is_some();
        let vertex = Vertex {
            ray,
            hit,
            met,
            point,
            sampler,
            first: dimension::vertex(segments),
            segments,
            wo: point.frame.to_local(-direction),
            normal: if F::DIELECTRIC && bsdf.transmits() { Vec3::ZERO } else { point.frame.normal },
            distance,
            travelled: path.travelled + distance,
            throughput: path.throughput.into(),
            apart: F::GLOSSY && has_photons && bsdf.is_varnished(self.context.separates_coats()),
            bsdf,
        };
        let known = self.known(path, exchange, &vertex, came);
        self.direct(path, exchange, &vertex, &known, shadows);
        if known.ends {
            return None;
        }
        let gathered = self.photons_at(path, exchange, &vertex);
        let merged = self.merge_at(path, exchange, &vertex);
        self.scatter(path, exchange, &vertex, (&known, gathered, merged), counters)
    }

    /// Adds light of the environment, which the ray reaches.
    fn escape(&self, path: &mut PathState, ray: &Ray) {
        let Some(environment) =
            self.context.scene.environment.as_ref().filter(|_| path.share.sees_emitters())
        else {
            return;
        };
        let (position, direction) = (Vec3::from(path.position), Vec3::from(ray.direction));
        let radiance = environment.radiance(self.context.scene, direction);
        let mut weight = 1.0;
        if path.pdf < f32::INFINITY && radiance != Rgb::ZERO {
            let pdf =
                self.context.lights.pdf_escape(self.context.scene, position, path.normal.into(), direction);
            weight = environment_heuristic(self.context.lights, path.pdf, pdf);
        }
        if let Some(merging) = &self.merging {
            weight = merging.beside_photons(weight, path.chain_to_light(), || {
                merging.emission.density_of_sky(self.context.scene, self.context.lights, direction, position)
            });
        }
        path.add(Rgb::from(path.throughput) * radiance * weight);
    }

    /// Adds light that the surface at `point` emits.
    #[inline]
    fn emission(&self, path: &mut PathState, point: &SurfacePoint, (ray, hit): (&Ray, &Hit)) {
        if !(point.material.emits() && path.share.sees_lamps()) {
            return;
        }
        let radiance = emitted(self.context.scene, hit.triangle, point.uv, point.front);
        if radiance == Rgb::ZERO {
            return;
        }
        let (position, direction) = (Vec3::from(path.position), Vec3::from(ray.direction));
        let mut weight = 1.0;
        if path.pdf < f32::INFINITY {
            let distance = position.distance(point.position);
            let normal = path.normal.into();
            let pdf = self.context.lights.pdf_hit(
                self.context.scene,
                position,
                normal,
                hit.triangle,
                distance,
                direction,
            );
            weight = power_heuristic(path.pdf, pdf);
        }
        if let Some(merging) = &self.merging {
            weight = merging.beside_photons(weight, path.chain_to_light(), || {
                let from = (point.position, -direction);
                merging.emission.density_of_surface(
                    self.context.scene,
                    self.context.lights,
                    hit.triangle,
                    from,
                )
            });
        }
        path.add(Rgb::from(path.throughput) * radiance * weight);
    }

    /// Adds light that a photon map or an irradiance cache knows, and says which light is left. `came` is the light
    /// that the path was to find when it came here.
    #[inline]
    fn known(
        &self,
        path: &mut PathState,
        exchange: &mut ReuseState,
        vertex: &Vertex,
        came: Components,
    ) -> Known {
        let Vertex { point, ref bsdf, throughput, segments, .. } = *vertex;
        let mut said = MapLookup::default();
        if let Some(maps) = self.maps {
            let turns = vertex.sampler.single(dimension::PROBES + segments);
            let limit = if self.is_limited() { segments } else { 0 };
            let maps = &maps[path.sample as usize & 1];
            let surface = (point, bsdf);
            let from = (vertex.wo, vertex.travelled);
            said = maps.ask(&self.context, (came, limit, vertex.distance), surface, from, turns);
            path.gather(throughput, exchange, said.gathered);
        }
        let mut known = Known { said, points: 1, ends: false };
        // Where lights are small all around, and nothing mirrors them, a shadow ray alone finds the direct light. Not
        // that of an environment, which is not sampled where it seemed to be hidden. Both take several light samples.
        if let (Some(indirect), Bsdf::Diffuse(diffuse)) = (vertex.met.indirect, bsdf)
            && !known.said.is_all
        {
            path.add(throughput * diffuse.reflectance * indirect.irradiance * FRAC_1_PI);
            path.share = Components::DIRECT;
            known.said.next = Components::DIRECT;
            let has_environment = self.context.scene.environment.is_some();
            known.ends = indirect.shining < SMALL && !self.context.has_mirrors && !has_environment;
            known.points = if known.ends || has_environment { path.lights.max(1).into() } else { 1 };
        }
        known
    }

    /// Adds light reflected from photons (`density.rs`); whether the surface stores any.
    #[inline]
    fn photons_at(&self, path: &mut PathState, exchange: &mut ReuseState, vertex: &Vertex) -> bool {
        let Some(photons) = self.photons.as_ref().filter(|_| vertex.segments == 1 || !self.is_limited())
        else {
            return false;
        };
        let turns = vertex.sampler.single(dimension::PROBES + vertex.segments);
        let surface = (vertex.point, &vertex.bsdf);
        let from = (vertex.wo, vertex.travelled);
        let reflected = photons.reflected(&self.context, surface, from, turns);
        path.gather(vertex.throughput, exchange, reflected.unwrap_or_default());
        reflected.is_some()
    }

    /// Adds caustics from photons, where the path merges with them at this vertex (`merge.rs`).
    #[inline]
    fn merge_at(&self, path: &mut PathState, exchange: &mut ReuseState, vertex: &Vertex) -> MergeState {
        let merged = path.merged;
        let Some(merging) = self.merging.as_ref().filter(|_| merged.may_come()) else { return merged };
        let met = merging.met(path, vertex.point.position, vertex.segments, self.is_limited());
        met.unwrap_or_else(|| {
            let turns = || vertex.sampler.single(dimension::PROBES + vertex.segments);
            let from = (vertex.wo, if path.disc == 0.0 { vertex.travelled } else { 0.0 });
            let surface = (vertex.point, &vertex.bsdf);
            let gathered = merging.reflected(&self.context, path.sample, surface, from, turns);
            path.gather(vertex.throughput, exchange, gathered);
            MergeState::LATER
        })
    }
}
