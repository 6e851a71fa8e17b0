//! The techniques of bidirectional path tracing (Veach 1997, section 10.2): a camera subpath hits a light,
//! samples one, or is connected with a light subpath; or the camera sees the end of a light subpath. Each
//! gives light and its weight among all techniques.

use crate::Rgb;
use crate::bsdf::Features;
use crate::film::Tile;
use crate::geometry::Ray;
use crate::light::{LightSample, emitted};
use crate::sampling::warp::concentric_disk;
use crate::scene::{Camera, CameraKind, Projection, SurfacePoint};
use crate::transport::walk::subpath::{Subpath, Vertex, Walk};
use crate::transport::walk::sums::{
    Counts, End, Sums, weight_of_connection, weight_of_hit, weight_of_light_sample, weight_of_splat,
};
use crate::transport::walk::vertex::Scattering;
use glam::{Vec2, Vec3};

/// Light that a technique brings, its weight included.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weighted {
    pub radiance: Rgb,
    /// Share of the techniques of path tracing among the densities of all techniques.
    pub by_paths: f32,
}

impl Weighted {
    /// True if there is light.
    #[inline]
    pub(crate) fn is_some(&self) -> bool {
        self.radiance.max_element() > 0.0 && self.radiance.is_finite()
    }
}

/// A light sample, with f |cos| of its direction and the density of BSDF sampling there.
pub(crate) struct Lit {
    pub light: LightSample,
    pub value: Rgb,
    pub pdf: f32,
    pub ray: Ray,
}

/// Segment from a camera vertex to a light vertex, and the scattering at its start.
pub(crate) struct Link {
    pub squared: f32,
    to_light: Vec3,
    at_camera: Scattering,
}

/// End of a light subpath.
pub(crate) struct LightEnd<'v> {
    pub vertex: Vertex<'v>,
    /// W on arrival, and its factor.
    pub power: Rgb,
    pub factor: f32,
    /// Sums of the techniques of path tracing on arrival.
    pub path_sums: Sums,
}

/// Light of a light subpath for the pixel at `position` of the film, if its shadow ray reaches the lens.
pub(crate) struct LensSample {
    pub position: u32,
    pub ray: Ray,
    pub light: Weighted,
}

impl<F: Features> Walk<'_, F> {
    /// Light of the environment that a camera subpath hits in `direction`.
    #[inline]
    pub(crate) fn escape(&self, subpath: &Subpath, direction: Vec3) -> Option<Weighted> {
        let Self { context, emission, .. } = self;
        let (scene, lights) = (context.scene, &context.lights);
        let radiance = scene.environment.as_ref()?.radiance(scene, direction);
        self.hit(subpath, radiance, |position, normal| {
            let density = match self.has_light_paths() {
                true => emission.density_of_environment(scene, lights, direction, position),
                false => 0.0,
            };
            (lights.pdf_escape(scene, position, normal, direction), density)
        })
    }

    /// Light of the surface that a camera subpath hits.
    #[inline]
    pub(crate) fn emission(
        &self,
        subpath: &Subpath,
        point: &SurfacePoint,
        direction: Vec3,
    ) -> Option<Weighted> {
        let Self { context, emission, .. } = self;
        let (scene, lights) = (context.scene, &context.lights);
        let radiance = emitted(scene, point.triangle, &point.attributes, point.front);
        self.hit(subpath, radiance, |position, normal| {
            let from = (point.position, -direction);
            let density = match self.has_light_paths() {
                true => emission.density_of_surface(scene, lights, point.triangle, from),
                false => 0.0,
            };
            let distance = position.distance(point.position);
            (lights.pdf_hit(scene, position, normal, point.triangle, distance, direction), density)
        })
    }

    /// Light of `radiance` that is hit. `densities` are those of light samples and of emission, as seen from
    /// the last vertex and its normal.
    #[inline]
    fn hit(
        &self,
        subpath: &Subpath,
        radiance: Rgb,
        densities: impl Fn(Vec3, Vec3) -> (f32, f32),
    ) -> Option<Weighted> {
        if radiance == Rgb::ZERO {
            return None;
        }
        let (mut weight, mut of_paths) = (1.0, 1.0);
        if subpath.segments > 1 {
            let pdf = (subpath.pdf < f32::INFINITY).then_some(subpath.pdf);
            let (pdf_light, density) = densities(subpath.position.into(), subpath.normal.into());
            // No light path splats direct light.
            let sums = if subpath.segments == 2 { Sums::default() } else { subpath.sums };
            weight = weight_of_hit(&self.counts, &sums, pdf, pdf_light, density);
            of_paths = weight_of_hit(&Counts::PATH_TRACING, &Sums::default(), pdf, pdf_light, 0.0);
        }
        let radiance = Rgb::from(subpath.throughput) * radiance * weight;
        Some(Weighted { radiance, by_paths: weight / of_paths }).filter(Weighted::is_some)
    }

    /// Samples a light at `vertex` by the numbers `u`, without lanes.
    #[inline]
    pub(crate) fn sample_light(&self, vertex: &Vertex, u: [f32; 3]) -> Option<Lit> {
        let (context, point) = (&self.context, vertex.at.point);
        let normal = vertex.at.normal_for_lights();
        let light = context.lights.sample(context.scene, point.position, normal, u)?;
        let wi = point.frame.to_local(light.direction);
        if !point.sides_agree(wi, light.direction) {
            return None;
        }
        let (value, pdf) = vertex.at.bsdf.evaluate::<F>(vertex.wo, wi);
        if value == Rgb::ZERO {
            return None;
        }
        Some(Lit { light, value, pdf, ray: context.shadow_ray(point, &light)? })
    }

    /// Light of the light sample `lit` at `vertex`, if nothing is in the way of its shadow ray.
    #[inline]
    pub(crate) fn light_sample(
        &self,
        subpath: &Subpath,
        vertex: &Vertex,
        Lit { light, value, pdf, .. }: &Lit,
    ) -> Weighted {
        let Self { context, emission, counts, .. } = self;
        let Vertex { at, wo, sums, is_bent, .. } = *vertex;
        let pdfs = (if light.delta { 0.0 } else { *pdf }, light.pdf);
        let (mut to_camera, mut density) = ((0.0, 0.0), 0.0);
        if self.has_light_paths() && subpath.segments > 1 && !is_bent {
            let wi = at.point.frame.to_local(light.direction);
            to_camera = (at.cos(light.direction), at.reverse_pdf(context, wo, wi));
            density = emission.density_of_sample(context.scene, &context.lights, light, at.point.position);
        }
        let weight = weight_of_light_sample(counts, &sums, pdfs, density, to_camera);
        let none = Sums::default();
        let of_paths = weight_of_light_sample(&Counts::PATH_TRACING, &none, pdfs, 0.0, (0.0, 0.0));
        let radiance = Rgb::from(subpath.throughput) * *value * light.radiance * (weight / light.pdf);
        Weighted { radiance, by_paths: weight / of_paths }
    }

    /// Segment from `vertex` of a camera subpath to `position`, if light that comes along it is scattered.
    #[inline]
    pub(crate) fn link(&self, vertex: &Vertex, position: Vec3) -> Option<Link> {
        let point = vertex.at.point;
        let between = position - point.position;
        let to_light = between.try_normalize()?;
        let wi = point.frame.to_local(to_light);
        if !point.sides_agree(wi, to_light) {
            return None;
        }
        let at_camera = vertex.at.scattering(&self.context, vertex.wo, wi);
        (at_camera.value != Rgb::ZERO).then(|| Link {
            squared: between.length_squared(),
            to_light,
            at_camera,
        })
    }

    /// Connection of a camera subpath at `vertex` by `link` with the `end` of a light subpath: its shadow
    /// ray, and its light if nothing is in the way. `merges` gives the merges of the path on the side of the
    /// camera and on that of the light, where the light walk goes back with a density.
    #[inline]
    pub(crate) fn connection(
        &self,
        (subpath, vertex): (&Subpath, &Vertex),
        &Link { squared, to_light, at_camera }: &Link,
        end: &LightEnd,
        merges: impl FnOnce(f32) -> [f32; 2],
    ) -> Option<(Ray, Weighted)> {
        let LightEnd { vertex: Vertex { at: other, back, wo: wi, sums, .. }, power, factor, path_sums } =
            *end;
        let out = other.point.frame.to_local(-to_light);
        if !other.point.sides_agree(out, -to_light) {
            return None;
        }
        let at_light = other.scattering_from_light(&self.context, out, wi);
        if at_light.value == Rgb::ZERO {
            return None;
        }
        let Scattering { pdf_to_light: reverse, pdf_to_camera: pdf, .. } = at_light;
        let [at_vertex, behind] = merges(reverse);
        let light = End { sums, pdf, reverse, cos: other.cos(to_light), merge: behind };
        let Scattering { pdf_to_light: pdf, pdf_to_camera: reverse, .. } = at_camera;
        let camera = End { sums: vertex.sums, pdf, reverse, cos: vertex.at.cos(to_light), merge: at_vertex };
        let weight = weight_of_connection(&self.counts, &camera, &light, squared);
        let by_paths = weight * (camera.pdf * light.cos / squared) * path_sums.before(light.reverse);
        let power = power * at_light.value * (light.cos / (other.cos(back) * squared)) * factor;
        let radiance = Rgb::from(subpath.throughput) * at_camera.value * power * weight;
        let target = other.point.spawn(-to_light).origin;
        let light = Weighted { radiance, by_paths };
        light.is_some().then(|| (vertex.at.point.spawn_to(target.into()), light))
    }

    /// Splat of the `end` of a light subpath, if the picture has a pixel there. `lens` gives two random
    /// numbers, `merge` the merge of the path where the light walk goes back with a density.
    #[inline]
    pub(crate) fn splat(
        &self,
        LightEnd { vertex, power, path_sums, .. }: &LightEnd,
        lens: impl FnOnce() -> [f32; 2],
        merge: impl FnOnce(f32) -> f32,
    ) -> Option<LensSample> {
        let Self { context, counts, size: [width, height], .. } = self;
        let Vertex { at, back, wo: wi, sums, .. } = *vertex;
        let (camera, point) = (&context.scene.camera, at.point);
        let lens = if camera.lens_radius > 0.0 { lens() } else { [0.5; 2] };
        let seen = camera.project(*width, *height, point.position, lens)?;
        let frame = Vec2::new(*width as f32, *height as f32);
        let is_inside = seen.raster.cmpge(Vec2::ZERO).all() && seen.raster.cmplt(frame).all();
        let to_camera = -seen.direction;
        let wo = point.frame.to_local(to_camera);
        if !(is_inside && point.sides_agree(wo, to_camera)) {
            return None;
        }
        let scattering = at.scattering_from_light(context, wo, wi);
        let reverse = scattering.pdf_to_light;
        let pdf_area = frame.x * frame.y * seen.pdf * at.cos(to_camera) / seen.distance / seen.distance;
        let weight = weight_of_splat(counts, &sums, pdf_area, reverse, merge(reverse));
        let by_paths = weight * pdf_area * path_sums.before(reverse) / counts.light_paths;
        // Power was counted by the geometric normal, which may differ from the shading normal (Veach 1997,
        // 5.3).
        let radiance = *power * scattering.value * (pdf_area * weight / at.cos(back));
        let light = Weighted { radiance, by_paths };
        light.is_some().then(|| LensSample {
            position: Tile::position([*width, *height], seen.raster.x as u32, seen.raster.y as u32) as u32,
            ray: point.spawn_to(lens_point(camera, lens, point.position, &seen)),
            light,
        })
    }
}

/// The point of the lens from which the camera sees `position` as `seen`.
pub(crate) fn lens_point(camera: &Camera, lens: [f32; 2], position: Vec3, seen: &Projection) -> Vec3 {
    if let CameraKind::Orthographic { .. } = camera.kind {
        return position - seen.distance * seen.direction;
    }
    if let Some(start) = camera.start {
        // Rays of a far camera start on a plane, because the eye is too far for f32.
        let beyond = seen.distance - start.depth / seen.direction.dot(camera.forward);
        return position - seen.direction * beyond.max(0.0);
    }
    let offset = camera.lens_radius * concentric_disk(lens);
    camera.eye + offset.x * camera.right + offset.y * camera.up
}
