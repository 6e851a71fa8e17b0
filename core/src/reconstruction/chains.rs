//! Clusters of camera rays: the chain of mirrors and smooth glass that a ray follows, and the component of
//! surface where it ends.
//!
//! A cluster is a hash of 32 bits, so that no table of clusters is needed. Two clusters with one number would
//! be filtered as one surface. A thousand clusters in view collide with a probability of 10⁻⁴, and the pair
//! matters only where both are in one window of a filter.

use super::components::SurfaceComponents;
use super::surfaces::NO_CLUSTER;
use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::bvh::Coherence;
use crate::geometry::{Hit, MISS, Ray};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::{ONE_MINUS_EPSILON, Sampler, mix};
use crate::scene::{Material, Surface, SurfacePoint};
use crate::transport::SceneContext;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Specular surfaces after which a chain ends.
const MAX_SPECULAR: u32 = 8;
/// Segments after which a ray counts as escaped: chains, and surfaces with cut-outs.
const MAX_SEGMENTS: usize = 64;
/// Reflectance at normal incidence from which the surfaces that a smooth coat mirrors count. Below it only
/// mirrored lamps do: they alone are brighter than the base.
const STRONG_COAT: f32 = 0.1;

/// Ends of chains that are no component, which are below 2³¹.
const ENVIRONMENT: u32 = u32::MAX;
/// Mirrored surfaces that do not count.
const DIM: u32 = u32::MAX - 1;

/// Opacity of the surface after `n` others: dimension `CROSSING + n`.
const CROSSING: u32 = 1 << 31;

/// Surface at the end of a ray.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Seen {
    /// Albedo of the surface where the ray ends.
    pub albedo: [f32; 3],
    /// Shading normal where the ray ends, on the side of the ray; zero in the environment.
    pub normal: [f32; 3],
    /// Distance of the first surface along the ray; 0 if it escapes.
    pub depth: f32,
    /// 1 if the ray ends at a lamp or its first partial reflection does.
    pub is_lamp: u32,
    /// Hash of the specular surfaces so far.
    chain: u32,
    /// Component where the ray ends.
    end: u32,
    /// Number of specular surfaces so far, and of surfaces.
    specular: u32,
    surfaces: u32,
    /// Component that the first partial reflection sees, plus one; 0 without a partial reflection.
    mirrored: u32,
    /// Triangle at the origin of the ray.
    triangle: u32,
    /// Triangle of the first surface; [`MISS`] if the ray escapes.
    pub first: u32,
}

impl Seen {
    /// Number of the cluster.
    pub(super) fn cluster(&self) -> u32 {
        let ends = u64::from(self.end) << 32 | u64::from(self.mirrored);
        match (mix(ends ^ mix(u64::from(self.chain))) >> 32) as u32 {
            NO_CLUSTER => 0,
            number => number,
        }
    }
}

/// Rays that are traced together. The tag of a ray is its index in the batch.
pub(super) struct Batch<'m> {
    pub rays: &'m mut [Ray],
    hits: &'m mut [Hit],
    pub seen: &'m mut [Seen],
    /// Reflections at glass and coats.
    reflected: &'m mut [Ray],
}

impl<'m> Batch<'m> {
    pub(super) fn footprint(rays: usize) -> Footprint {
        Footprint::default().slice::<Ray>(rays).slice::<Hit>(rays).slice::<Seen>(rays).slice::<Ray>(rays)
    }

    pub(super) fn new(rays: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let batch = (arena.slice(rays)?, arena.slice(rays)?, arena.slice(rays)?, arena.slice(rays)?);
        let (rays, hits, seen, reflected) = batch;
        Ok(Self { rays, hits, seen, reflected })
    }
}

/// Step of a ray at a hit.
enum Step {
    End,
    Onward(Ray),
}

/// Surface where rays of one triangle end, if it is the same for all.
#[derive(Clone, Copy, Default)]
struct Flat {
    triangle: u32,
    normal: Vec3,
    albedo: Rgb,
    is_lamp: bool,
}

/// Tracer of chains.
pub(super) struct Chains<'a, F> {
    pub context: SceneContext<'a, F>,
    pub components: SurfaceComponents<'a>,
    /// Distance below which a ray may start on the surface that it hits.
    near: f32,
}

impl<'a, F: Features> Chains<'a, F> {
    pub(super) fn new(context: SceneContext<'a, F>, components: SurfaceComponents<'a>) -> Self {
        let near = 1e-3 * context.bvh.bounds().diagonal();
        Self { context, components, near }
    }

    /// Follows the first `count` rays of the batch into `batch.seen`; `sampler` gives the random numbers of
    /// a ray. Albedo and normal are left out unless `with_surfaces`. Returns the number of traced rays.
    #[inline(never)]
    pub(super) fn trace(
        &self,
        batch: &mut Batch,
        count: usize,
        with_surfaces: bool,
        sampler: impl Fn(usize) -> Sampler,
    ) -> u64 {
        let Batch { rays, hits, seen, reflected } = batch;
        let count = count.min(rays.len());
        seen.iter_mut().take(count).for_each(|seen| {
            *seen = Seen { triangle: MISS, first: MISS, end: ENVIRONMENT, ..Seen::default() };
        });
        let mut flat = Flat { triangle: MISS, ..Flat::default() };
        let (mut live, mut traced) = (count, 0);
        for segment in 0..MAX_SEGMENTS {
            if live == 0 {
                break;
            }
            // Behind a plane mirror or a pane rays are still coherent.
            let coherence = if segment < 2 { Coherence::Coherent } else { Coherence::Incoherent };
            self.context.nearest_batch(&rays[..live], coherence, &mut hits[..live]);
            traced += live as u64;
            let (mut next, mut mirrors) = (0, 0);
            for i in 0..live {
                let (ray, hit) = (rays[i], hits[i]);
                let Some(seen) = seen.get_mut(ray.tag as usize) else { continue };
                let mut reflection = None;
                let random = |n: u32| sampler(ray.tag as usize).single(CROSSING.wrapping_add(n));
                if let Step::Onward(onward) =
                    self.arrive((&ray, &hit), seen, with_surfaces, &mut flat, &mut reflection, random)
                {
                    rays[next] = Ray { tag: ray.tag, ..onward };
                    next += 1;
                }
                if let Some(reflection) = reflection {
                    reflected[mirrors] = Ray { tag: ray.tag, ..reflection };
                    mirrors += 1;
                }
            }
            // Hits behind the first `next` are free.
            self.context.nearest_batch(&reflected[..mirrors], Coherence::Incoherent, &mut hits[..mirrors]);
            traced += mirrors as u64;
            for (ray, hit) in reflected.iter().zip(&**hits).take(mirrors) {
                if let Some(seen) = seen.get_mut(ray.tag as usize) {
                    traced += self.mirror(*ray, *hit, seen, &sampler(ray.tag as usize));
                }
            }
            live = next;
        }
        traced
    }

    /// Step of a ray at its hit.
    fn arrive(
        &self,
        (ray, hit): (&Ray, &Hit),
        seen: &mut Seen,
        with_surfaces: bool,
        flat: &mut Flat,
        reflection: &mut Option<Ray>,
        random: impl Fn(u32) -> f32,
    ) -> Step {
        let Some(material) = self.material(hit) else { return self.escape(seen) };
        if seen.specular == 0 {
            seen.depth += hit.t;
            seen.first = hit.triangle;
        }
        let ends_here = !material.has_cutout() && !material.surface.may_be_smooth();
        if ends_here && hit.triangle != seen.triangle && hit.t > self.near {
            if !with_surfaces {
                seen.is_lamp |= u32::from(material.emits());
                return self.end(hit, seen);
            }
            if hit.triangle == flat.triangle {
                flat.put(ray, seen);
                return self.end(hit, seen);
            }
        }
        let Some(point) = self.context.surface_at(ray, hit) else { return self.escape(seen) };
        let is_left = seen.surfaces == 0 && point.is_left_by(ray);
        let passes = |surfaces| self.context.passed(&point, (ray, hit), seen.triangle, || random(surfaces));
        if is_left || passes(seen.surfaces).is_some() {
            return self.onward(hit, seen, point.spawn(ray.direction.into()));
        }
        let bsdf = self.context.bsdf_at(&point);
        if !ends_here && let Some(onward) = self.specular((ray, hit), (&point, &bsdf), seen, reflection) {
            return self.onward(hit, seen, onward);
        }
        let albedo = albedo(&point, &bsdf);
        seen.albedo = albedo.to_array();
        seen.normal = point.frame.normal.to_array();
        seen.is_lamp |= u32::from(material.emits());
        if ends_here && self.is_uniform(material) {
            let normal = if point.front { point.geometric_normal } else { -point.geometric_normal };
            *flat = Flat { triangle: hit.triangle, normal, albedo, is_lamp: material.emits() };
        }
        self.end(hit, seen)
    }

    /// True if normal and albedo are the same all over a triangle of `material`.
    fn is_uniform(&self, material: &Material) -> bool {
        let is_textured = match &material.surface {
            Surface::Diffuse { reflectance } => reflectance.varies(),
            Surface::Conductor { reflectance, roughness } => reflectance.varies() || roughness.varies(),
            Surface::Glossy { base, specular, metallic, .. } => {
                base.varies() || specular.varies() || metallic.varies()
            }
            Surface::Dielectric { .. } | Surface::Mirror { .. } | Surface::Pane { .. } => false,
        };
        !self.context.scene.mesh.has_normals() && material.normal_map.is_none() && !is_textured
    }

    fn material(&self, hit: &Hit) -> Option<&'a Material> {
        let material = self.context.scene.mesh.material(hit.triangle)?;
        self.context.scene.materials.get(material as usize)
    }

    fn escape(&self, seen: &mut Seen) -> Step {
        if seen.specular == 0 {
            (seen.depth, seen.first) = (0.0, MISS);
        }
        (seen.end, seen.albedo, seen.normal) = (ENVIRONMENT, [1.0; 3], [0.0; 3]);
        Step::End
    }

    fn end(&self, hit: &Hit, seen: &mut Seen) -> Step {
        seen.end = self.components.of(hit.triangle);
        Step::End
    }

    fn onward(&self, hit: &Hit, seen: &mut Seen, ray: Ray) -> Step {
        (seen.triangle, seen.surfaces) = (hit.triangle, seen.surfaces + 1);
        // The value of rays that have too many segments.
        (seen.end, seen.albedo) = (ENVIRONMENT, [1.0; 3]);
        Step::Onward(ray)
    }

    /// Ray that leaves a specular surface, in the direction of the transmitted light if there is any; `None`
    /// where the chain ends. `reflection` is the ray from the first surface that also reflects.
    fn specular(
        &self,
        (ray, hit): (&Ray, &Hit),
        (point, bsdf): (&SurfacePoint, &Bsdf),
        seen: &mut Seen,
        reflection: &mut Option<Ray>,
    ) -> Option<Ray> {
        let wo = point.frame.to_local(-Vec3::from(ray.direction));
        let leave = |local: Vec3| {
            let direction = point.frame.to_world(local);
            point.sides_agree(local, direction).then(|| Ray { tag: ray.tag, ..point.spawn(direction) })
        };
        let mirrored = Vec3::new(-wo.x, -wo.y, wo.z);
        let mut transmits = false;
        let onward = match bsdf {
            Bsdf::Dielectric(_) => {
                // The last number chooses transmission unless the reflection is total.
                let sample = bsdf.sample::<F>(wo, [0.0, 0.0, ONE_MINUS_EPSILON])?;
                transmits = sample.transmitted;
                leave(sample.direction)
            }
            _ if bsdf.is_delta() => leave(mirrored),
            _ => None,
        };
        let reflects = transmits || matches!(bsdf, Bsdf::Glossy(_) | Bsdf::Plastic(_)) && onward.is_none();
        if reflects && seen.mirrored == 0 && !bsdf.has_rough_coat() {
            *reflection = leave(mirrored);
            // Its hit needs to know whether only lamps count.
            if reflection.is_some() {
                seen.mirrored = if transmits || is_strong_coat(point.material) { 1 } else { 2 };
                seen.triangle = hit.triangle;
            }
        }
        let onward = onward.filter(|_| seen.specular < MAX_SPECULAR)?;
        let surface = u64::from(self.components.of(hit.triangle)) << 1 | u64::from(transmits);
        seen.chain = (mix(u64::from(seen.chain) << 32 ^ mix(surface)) >> 32) as u32;
        seen.specular += 1;
        Some(onward)
    }

    /// Adds the surface that a partial reflection sees. Returns the number of rays traced behind cut-outs.
    fn mirror(&self, mut ray: Ray, mut hit: Hit, seen: &mut Seen, sampler: &Sampler) -> u64 {
        let lamps_only = seen.mirrored == 2;
        let mut left = seen.triangle;
        let mut traced = 0;
        let mut number = ENVIRONMENT;
        while traced < MAX_SEGMENTS as u64 {
            let Some(material) = self.material(&hit) else { break };
            let random = || sampler.single(CROSSING.wrapping_add(1 << 16).wrapping_add(traced as u32));
            if material.has_cutout() || hit.triangle == left {
                let Some(point) = self.context.surface_at(&ray, &hit) else { break };
                if self.context.passed(&point, (&ray, &hit), left, random).is_some() {
                    (left, ray) = (hit.triangle, point.spawn(ray.direction.into()));
                    hit = self.context.nearest(&ray);
                    traced += 1;
                    continue;
                }
            }
            let is_lamp = material.emits();
            seen.is_lamp |= u32::from(is_lamp);
            number = if lamps_only && !is_lamp { DIM } else { self.components.of(hit.triangle) };
            break;
        }
        if number == ENVIRONMENT && lamps_only && self.context.scene.environment.is_none() {
            number = DIM;
        }
        // Above the two marks.
        seen.mirrored = number.wrapping_add(3);
        traced
    }
}

impl Flat {
    /// Surface at the end of `ray`.
    fn put(&self, ray: &Ray, seen: &mut Seen) {
        let is_front = self.normal.dot(ray.direction.into()) <= 0.0;
        seen.normal = if is_front { self.normal } else { -self.normal }.to_array();
        seen.albedo = self.albedo.to_array();
        seen.is_lamp |= u32::from(self.is_lamp);
    }
}

/// True if the surfaces that a smooth coat of `material` mirrors may be as bright as its base.
fn is_strong_coat(material: &Material) -> bool {
    let Surface::Glossy { specular, metallic, .. } = &material.surface else { return true };
    metallic.value.max(specular.value.max_element()) > STRONG_COAT
}

/// Albedo of the surface where a ray ends, 0 to 1: light at normal incidence. 1 for lamps.
fn albedo(point: &SurfacePoint, bsdf: &Bsdf) -> Rgb {
    if point.material.emits() {
        return Rgb::ONE;
    }
    bsdf.normal_albedo().clamp(Rgb::ZERO, Rgb::ONE)
}
