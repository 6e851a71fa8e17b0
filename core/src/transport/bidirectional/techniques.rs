//! The techniques of a camera path: it hits a light, samples one, or is connected to a vertex of a light path
//! (Veach 1997, section 10.2).

use crate::Rgb;
use crate::bsdf::Features;
use crate::geometry::{Hit, Ray};
use crate::light::emitted;
use crate::sampling::{ONE_MINUS_EPSILON, Sampler};
use crate::scene::SurfacePoint;
use crate::transport::bidirectional::arrival::Arrival;
use crate::transport::bidirectional::camera_path::{CameraPath, Queue, Vertex};
use crate::transport::bidirectional::camera_paths::{CameraPaths, Connections};
use crate::transport::bidirectional::contribution::Class;
use crate::transport::bidirectional::mis::{
    End, weight_of_connection, weight_of_hit, weight_of_light_sample,
};
use crate::transport::bidirectional::shaded::Lit;
use crate::transport::bidirectional::vertex::normal_for_lights;
use crate::transport::bidirectional::vertex::{
    LightVertex, Scattering, reverse_pdf, scattering, scattering_from_light,
};
use crate::transport::walk::dimension;
use glam::Vec3;

impl<F: Features> CameraPaths<'_, F> {
    /// Light of the environment.
    pub(super) fn escape(&self, path: &mut CameraPath, direction: Vec3) {
        let Self { context, emission, counts, .. } = self;
        let Some(environment) = &context.scene.environment else { return };
        let radiance = environment.radiance(context.scene, direction);
        if radiance == Rgb::ZERO {
            return;
        }
        let mut weight = 1.0;
        if path.segments > 1 {
            let (position, normal) = (Vec3::from(path.position), Vec3::from(path.normal));
            let pdf = (path.pdf < f32::INFINITY).then_some(path.pdf);
            let pdf_light = context.lights.pdf_escape(context.scene, position, normal, direction);
            let density = match counts.light_paths > 0.0 {
                true => emission.density_of_environment(context.scene, &context.lights, direction, position),
                false => 0.0,
            };
            weight = weight_of_hit(counts, &path.sums_of_hit(), pdf, pdf_light, density);
        }
        path.add(Rgb::from(path.throughput) * radiance * weight);
    }

    /// Light of the surface that was hit.
    pub(super) fn emission(&self, path: &mut CameraPath, point: &SurfacePoint, hit: &Hit, direction: Vec3) {
        let Self { context, emission, counts, .. } = self;
        let (scene, lights) = (context.scene, &context.lights);
        let radiance = emitted(scene, hit.triangle, point.uv, point.front);
        if radiance == Rgb::ZERO {
            return;
        }
        let mut weight = 1.0;
        if path.segments > 1 {
            let (position, normal) = (Vec3::from(path.position), Vec3::from(path.normal));
            let pdf = (path.pdf < f32::INFINITY).then_some(path.pdf);
            let distance = position.distance(point.position);
            let pdf_light = lights.pdf_hit(scene, position, normal, hit.triangle, distance, direction);
            let from = (point.position, -direction);
            let density = match counts.light_paths > 0.0 {
                true => emission.density_of_surface(scene, lights, hit.triangle, from),
                false => 0.0,
            };
            weight = weight_of_hit(counts, &path.sums_of_hit(), pdf, pdf_light, density);
        }
        path.add(Rgb::from(path.throughput) * radiance * weight);
    }

    /// A light sample: its shadow ray, with what arrives if nothing is in its way.
    pub(super) fn light_sample(
        &self,
        path: &CameraPath,
        vertex: &Vertex,
        tag: u32,
        queue: &mut Queue,
    ) -> Option<()> {
        let Self { context, emission, counts, .. } = self;
        let (scene, lights) = (context.scene, &context.lights);
        let Vertex { point, bsdf, wo, sums, .. } = *vertex;
        let Lit { light, value, pdf, ray } = match &vertex.shaded {
            Some(shaded) => shaded.lit(context)?,
            None => self.sample_light(path.segments, vertex)?,
        };
        let pdf = if light.delta { 0.0 } else { pdf };
        let mut emitted = (0.0, 0.0);
        let mut density = 0.0;
        if counts.light_paths > 0.0 && path.segments > 1 && !vertex.is_bent {
            let cos = light.direction.dot(point.geometric_normal).abs();
            let wi = point.frame.to_local(light.direction);
            emitted = (cos, reverse_pdf(context, (point, bsdf), wo, wi));
            density = emission.density_of_sample(scene, lights, &light, point.position);
        }
        let weight = weight_of_light_sample(counts, &sums, (pdf, light.pdf), density, emitted);
        let radiance = Rgb::from(path.throughput) * value * light.radiance * (weight / light.pdf);
        let rest = path.history.rest_of_sample();
        queue.push((Class::Paths, rest), tag, ray, radiance);
        Some(())
    }

    /// Samples a light at a vertex that ends segment `segments`, without lanes.
    fn sample_light(&self, segments: u32, vertex: &Vertex) -> Option<Lit> {
        let (scene, lights) = (self.context.scene, &self.context.lights);
        let Vertex { point, bsdf, wo, sampler, .. } = *vertex;
        let normal = normal_for_lights(point, bsdf);
        let first = dimension::vertex(segments);
        let [u, v] = sampler.pair(first + dimension::LIGHT);
        let choice = sampler.single(first + dimension::LIGHT_CHOICE);
        let light = lights.sample(scene, point.position, normal, [u, v, choice])?;
        let wi = point.frame.to_local(light.direction);
        if !point.sides_agree(wi, light.direction) {
            return None;
        }
        let (value, pdf) = bsdf.evaluate::<F>(wo, wi);
        if value == Rgb::ZERO {
            return None;
        }
        Some(Lit { light, value, pdf, ray: self.context.shadow_ray(point, &light)? })
    }

    /// Draws the light vertices that the vertex at the end of a path's segment is connected to, one of each
    /// of as many parts of their list.
    pub(super) fn draw(&self, path: &CameraPath, sampler: &Sampler, drawn: &mut [u32]) {
        let Connections { vertices, count } = self.connections;
        let random = sampler.single(dimension::CONNECTION + path.segments);
        for (part, index) in drawn.iter_mut().enumerate() {
            let at = ((part as f32 + random) / count as f32).min(ONE_MINUS_EPSILON);
            *index = (at * vertices.len() as f32) as u32;
        }
    }

    /// Connections to the light vertices `drawn`.
    pub(super) fn connect(
        &self,
        path: &CameraPath,
        vertex: &Vertex,
        drawn: &[LightVertex],
        tag: u32,
        queue: &mut Queue,
    ) {
        let each = self.connections.vertices.len() as f32 / self.connections.count as f32;
        for light in drawn {
            if let Some((ray, radiance)) = self.connection(path, vertex, light) {
                let rest = path.history.rest_of_connection(light.rest());
                queue.push((Class::Connections, rest), tag, ray, radiance * each);
            }
        }
    }

    /// The connection of a camera vertex with a light vertex: its shadow ray, and what arrives if nothing is
    /// in its way.
    fn connection(&self, path: &CameraPath, vertex: &Vertex, light: &LightVertex) -> Option<(Ray, Rgb)> {
        let Self { context, counts, settings, .. } = self;
        if path.segments + u32::from(light.segments) + 1 > settings.max_depth {
            return None;
        }
        let Vertex { point, bsdf, wo, sums, is_first_rough, eta_vcm, .. } = *vertex;
        let between = Vec3::from(light.position) - point.position;
        let squared = between.length_squared();
        let to_light = between.try_normalize()?;
        let wi = point.frame.to_local(to_light);
        if !point.sides_agree(wi, to_light) {
            return None;
        }
        let at_camera = scattering(context, (point, bsdf), wo, wi);
        if at_camera.value == Rgb::ZERO {
            return None;
        }
        let other = light.point(context)?;
        let other_bsdf = context.bsdf_at(&other);
        let (out, back) = (other.frame.to_local(-to_light), other.frame.to_local(light.to_light.into()));
        if !other.sides_agree(out, -to_light) {
            return None;
        }
        let at_light = scattering_from_light(context, (&other, &other_bsdf), out, back);
        if at_light.value == Rgb::ZERO {
            return None;
        }
        let cos = |point: &SurfacePoint, direction: Vec3| direction.dot(point.geometric_normal).abs();
        let (cos_camera, cos_light) = (cos(point, to_light), cos(&other, to_light));
        // The one merge of the path: at this vertex, or on the side of the light.
        let from_caster = other_bsdf.is_caustic_caster();
        let Scattering { pdf_to_light: pdf, pdf_to_camera: reverse, .. } = at_camera;
        let arrival = Arrival::of(from_caster, squared, self.near(eta_vcm));
        let is_merged = arrival.is_some_and(|arrival| arrival.is_merged(path.segments));
        let merge = if is_merged { eta_vcm } else { 0.0 };
        let camera_end = End { sums, pdf, reverse, cos: cos_camera, merge };
        let Scattering { pdf_to_light: reverse, pdf_to_camera: pdf, .. } = at_light;
        let merge = match is_first_rough || path.has_rough() {
            true => 0.0,
            false => light.sums.pending_merge * if from_caster { reverse } else { 1.0 },
        };
        let light_end = End { sums: light.sums, pdf, reverse, cos: cos_light, merge };
        let weight = weight_of_connection(counts, &camera_end, &light_end, squared);
        let cos_in = cos(&other, light.to_light.into());
        let power = Rgb::from(light.power) * at_light.value * (cos_light / (cos_in * squared));
        let radiance = Rgb::from(path.throughput) * at_camera.value * power * weight;
        let target = other.spawn(-to_light).origin;
        (radiance.max_element() > 0.0 && radiance.is_finite())
            .then(|| (point.spawn_to(target.into()), radiance))
    }
}
