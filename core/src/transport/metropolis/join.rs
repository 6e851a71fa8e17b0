//! The techniques that join subpaths: a camera subpath meets a light or samples one, is connected to a light
//! subpath, or the camera sees the end of a light subpath (Veach 1997, section 10.2).

use super::split::Contribution;
use super::subpath::{PATH_TRACING, Subpath, Vertex, Walk};
use crate::Rgb;
use crate::bsdf::Features;
use crate::film::Tile;
use crate::geometry::Ray;
use crate::light::emitted;
use crate::scene::SurfacePoint;
use crate::transport::bidirectional::light_pass::lens_point;
use crate::transport::bidirectional::mis::{
    End, Sums, weight_of_connection, weight_of_hit, weight_of_light_sample, weight_of_splat,
};
use crate::transport::bidirectional::shaded::Lit;
use crate::transport::bidirectional::vertex::normal_for_lights;
use crate::transport::bidirectional::vertex::{reverse_pdf, scattering, scattering_from_light};
use crate::transport::walk::context::SceneContext;
use glam::{Vec2, Vec3};

impl<F: Features> Walk<'_, F> {
    /// Light of the environment that a camera subpath meets in `direction`.
    pub(super) fn escape(&self, subpath: &Subpath, direction: Vec3) -> Option<Contribution> {
        let Self { context, emission, .. } = self;
        let (scene, lights) = (context.scene, &context.lights);
        let radiance = scene.environment.as_ref()?.radiance(scene, direction);
        let densities = || {
            let (position, normal) = (Vec3::from(subpath.position), Vec3::from(subpath.normal));
            let density = match self.has_light_paths() {
                true => emission.density_of_environment(scene, lights, direction, position),
                false => 0.0,
            };
            (lights.pdf_escape(scene, position, normal, direction), density)
        };
        self.hit(subpath, radiance, densities)
    }

    /// Light of the surface that a camera subpath meets.
    pub(super) fn emission(
        &self,
        subpath: &Subpath,
        point: &SurfacePoint,
        direction: Vec3,
    ) -> Option<Contribution> {
        let Self { context, emission, .. } = self;
        let (scene, lights) = (context.scene, &context.lights);
        let radiance = emitted(scene, point.triangle, point.uv, point.front);
        let densities = || {
            let (position, normal) = (Vec3::from(subpath.position), Vec3::from(subpath.normal));
            let distance = position.distance(point.position);
            let density = match self.has_light_paths() {
                true => {
                    let from = (point.position, -direction);
                    emission.density_of_surface(scene, lights, point.triangle, from)
                }
                false => 0.0,
            };
            (lights.pdf_hit(scene, position, normal, point.triangle, distance, direction), density)
        };
        self.hit(subpath, radiance, densities)
    }

    /// The contribution of light of `radiance` that is met; `densities` are those of light samples and of
    /// emission.
    fn hit(
        &self,
        subpath: &Subpath,
        radiance: Rgb,
        densities: impl Fn() -> (f32, f32),
    ) -> Option<Contribution> {
        if radiance == Rgb::ZERO {
            return None;
        }
        let (mut weight, mut of_paths) = (1.0, 1.0);
        if subpath.segments > 1 {
            let pdf = (subpath.pdf < f32::INFINITY).then_some(subpath.pdf);
            let (pdf_light, density) = densities();
            weight = weight_of_hit(&self.counts, &subpath.sums, pdf, pdf_light, density);
            of_paths = weight_of_hit(&PATH_TRACING, &Sums::default(), pdf, pdf_light, 0.0);
        }
        contribution(Rgb::from(subpath.throughput) * radiance * weight, weight / of_paths)
    }

    /// Samples a light at `vertex` by the numbers `u`, without lanes.
    pub(super) fn sample_light(&self, vertex: &Vertex, u: [f32; 3]) -> Option<Lit> {
        let SceneContext { scene, ref lights, .. } = self.context;
        let Vertex { point, bsdf, wo, .. } = vertex;
        let light = lights.sample(scene, point.position, normal_for_lights(point, bsdf), u)?;
        let wi = point.frame.to_local(light.direction);
        if !point.sides_agree(wi, light.direction) {
            return None;
        }
        let (value, pdf) = bsdf.evaluate::<F>(*wo, wi);
        if value == Rgb::ZERO {
            return None;
        }
        Some(Lit { light, value, pdf, ray: self.context.shadow_ray(point, &light)? })
    }

    /// The light sample `lit` at `vertex`: its shadow ray, with the light that arrives if nothing is in its
    /// way.
    pub(super) fn light_sample(
        &self,
        subpath: &Subpath,
        vertex: &Vertex,
        Lit { light, value, pdf, ray }: Lit,
    ) -> Option<(Ray, Contribution)> {
        let Self { context, emission, counts, .. } = self;
        let (scene, lights) = (context.scene, &context.lights);
        let Vertex { point, bsdf, wo, sums: [sums, _], is_bent, .. } = vertex;
        let densities = (if light.delta { 0.0 } else { pdf }, light.pdf);
        let (mut emitted, mut density) = ((0.0, 0.0), 0.0);
        if self.has_light_paths() && !is_bent {
            let wi = point.frame.to_local(light.direction);
            emitted = (vertex.cos(light.direction), reverse_pdf(context, (point, bsdf), *wo, wi));
            density = emission.density_of_sample(scene, lights, &light, point.position);
        }
        let weight = weight_of_light_sample(counts, sums, densities, density, emitted);
        let of_paths = weight_of_light_sample(&PATH_TRACING, &Sums::default(), densities, 0.0, (0.0, 0.0));
        let radiance = Rgb::from(subpath.throughput) * value * light.radiance * (weight / light.pdf);
        Some((ray, contribution(radiance, weight / of_paths)?))
    }

    /// The connection of a camera subpath at `vertex` with a `light` subpath that has ended at `other`.
    pub(super) fn connection(
        &self,
        (camera, vertex): (&Subpath, &Vertex),
        (light, other): (&Subpath, &Vertex),
    ) -> Option<(Ray, Contribution)> {
        let Self { context, counts, .. } = self;
        if vertex.is_bent || vertex.bsdf.is_delta() || other.bsdf.is_delta() {
            return None;
        }
        let between = other.point.position - vertex.point.position;
        let squared = between.length_squared();
        let towards = between.try_normalize()?;
        let wi = vertex.point.frame.to_local(towards);
        let out = other.point.frame.to_local(-towards);
        if !(vertex.point.sides_agree(wi, towards) && other.point.sides_agree(out, -towards)) {
            return None;
        }
        let at_camera = scattering(context, (&vertex.point, &vertex.bsdf), vertex.wo, wi);
        if at_camera.value == Rgb::ZERO {
            return None;
        }
        let at_light = scattering_from_light(context, (&other.point, &other.bsdf), out, other.wo);
        if at_light.value == Rgb::ZERO {
            return None;
        }
        let camera_end = End {
            sums: vertex.sums[0],
            pdf: at_camera.pdf_to_light,
            reverse: at_camera.pdf_to_camera,
            cos: vertex.cos(towards),
            merge: 0.0,
        };
        let light_end = End {
            sums: light.sums,
            pdf: at_light.pdf_to_camera,
            reverse: at_light.pdf_to_light,
            cos: other.cos(towards),
            merge: 0.0,
        };
        let weight = weight_of_connection(counts, &camera_end, &light_end, squared);
        let pdf_area = camera_end.pdf * light_end.cos / squared;
        let by_paths = weight * pdf_area * light.path_sums.before(light_end.reverse);
        let power = Rgb::from(light.throughput) * at_light.value;
        let power = power * (light_end.cos / (other.cos(other.back) * squared));
        // The power of a light subpath is over the number of pixels, as if all of them were traced.
        let power = power * counts.light_paths;
        let radiance = Rgb::from(camera.throughput) * at_camera.value * power * weight;
        let target = other.point.spawn(-towards).origin;
        Some((vertex.point.spawn_to(target.into()), contribution(radiance, by_paths)?))
    }

    /// The splat of a light subpath at `vertex`: the pixel's position in the film, and the shadow ray.
    pub(super) fn splat(
        &self,
        light: &Subpath,
        vertex: &Vertex,
        lens: [f32; 2],
    ) -> Option<(u32, Ray, Contribution)> {
        let Self { context, counts, size: [width, height], .. } = *self;
        let Vertex { point, bsdf, back, wo: wi, sums: [sums, path_sums], .. } = vertex;
        let camera = &context.scene.camera;
        if bsdf.is_delta() {
            return None;
        }
        let lens = if camera.lens_radius > 0.0 { lens } else { [0.5; 2] };
        let seen = camera.project(width, height, point.position, lens)?;
        let is_inside = seen.raster.cmpge(Vec2::ZERO).all()
            && seen.raster.x < width as f32
            && seen.raster.y < height as f32;
        if !is_inside {
            return None;
        }
        let to_camera = -seen.direction;
        let wo = point.frame.to_local(to_camera);
        if !point.sides_agree(wo, to_camera) {
            return None;
        }
        let scattering = scattering_from_light(&context, (point, bsdf), wo, *wi);
        let pixels = width as f32 * height as f32;
        let pdf_area = pixels * seen.pdf * vertex.cos(to_camera) / seen.distance / seen.distance;
        let weight = weight_of_splat(&counts, sums, pdf_area, scattering.pdf_to_light, 0.0);
        let by_paths = weight * pdf_area * path_sums.before(scattering.pdf_to_light) / counts.light_paths;
        let power = Rgb::from(light.throughput) * scattering.value;
        let radiance = power * (pdf_area * weight / vertex.cos(*back));
        let ray = point.spawn_to(lens_point(camera, lens, point.position, &seen));
        let pixel = Tile::position([width, height], seen.raster.x as u32, seen.raster.y as u32) as u32;
        Some((pixel, ray, contribution(radiance, by_paths)?))
    }
}

fn contribution(radiance: Rgb, by_paths: f32) -> Option<Contribution> {
    (radiance.max_element() > 0.0 && radiance.is_finite()).then_some(Contribution { radiance, by_paths })
}
