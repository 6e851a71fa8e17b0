//! Shadow rays from a surface point to a light, and their transmittance through cut-outs and panes.

use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::geometry::{Hit, Ray};
use crate::light::LightSample;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::termination::MAX_CROSSINGS;
use glam::Vec3;
use halflight_simd::kernels::triangles::{Shear, intersect};

/// Factor on the `t` at which the tracer hits a lamp, for the end of a shadow ray: four roundings below it,
/// so that a surface in the plane of the lamp does not hide it.
const BEFORE_LAMP: f32 = 1.0 - 4.0 * f32::EPSILON;

/// Number of rays below which rays are traced one by one, since a batch has a setup cost.
const FEW: usize = 32;

/// Queue of shadow rays that are traced together, and working memory for them.
pub(crate) struct ShadowRays<'w> {
    pub(crate) rays: &'w mut [Ray],
    /// Unoccluded contribution of each ray.
    pub(crate) light: &'w mut [[f32; 3]],
    hits: &'w mut [Hit],
    hidden: &'w mut [u8],
    /// Number of rays.
    pub(crate) count: usize,
}

impl<'w> ShadowRays<'w> {
    /// Memory of a queue of `capacity` rays.
    pub(crate) fn footprint(capacity: usize) -> Footprint {
        let rays = Footprint::default().slice::<Ray>(capacity).slice::<[f32; 3]>(capacity);
        rays.slice::<Hit>(capacity).slice::<u8>(capacity)
    }

    /// An empty queue.
    pub(crate) fn new(capacity: usize, arena: &mut Arena<'w>) -> Result<Self, OutOfMemory> {
        Ok(Self {
            rays: arena.slice(capacity)?,
            light: arena.slice(capacity)?,
            hits: arena.slice(capacity)?,
            hidden: arena.slice(capacity)?,
            count: 0,
        })
    }

    /// Queues `ray` with its contribution `light`, if there is room.
    #[inline]
    pub(crate) fn push(&mut self, ray: Ray, light: Rgb) {
        let slots = (self.rays.get_mut(self.count), self.light.get_mut(self.count));
        if let (Some(slot), Some(contribution)) = slots {
            (*slot, *contribution) = (ray, light.to_array());
            self.count += 1;
        }
    }

    /// Traces the queue and empties it. `arrive` gets each ray that reaches its light, and the transmitted
    /// light. Rays that hit too many cut-outs are counted as unfinished.
    #[inline(never)]
    pub(crate) fn trace<F: Features>(
        &mut self,
        context: &SceneContext<F>,
        counters: &mut Counters,
        mut arrive: impl FnMut(&Ray, Rgb),
    ) {
        let count = core::mem::take(&mut self.count);
        let traced = &mut counters.shadow_rays;
        if context.has_cutouts {
            counters.dropped.unfinished += context.trace_through_cutouts(self, count, traced, arrive);
            return;
        }
        *traced += count as u64;
        let (rays, hidden) = (&self.rays[..count], &mut self.hidden[..count]);
        context.bvh.occluded_batch(context.level, rays, hidden);
        for ((ray, light), hidden) in rays.iter().zip(&*self.light).zip(&*hidden) {
            if *hidden == 0 {
                arrive(ray, Rgb::from(*light));
            }
        }
    }
}

impl<F: Features> SceneContext<'_, F> {
    /// Shadow ray from `point` to the light of `sample`, which hits neither end. `None` if the offset light
    /// point is on the other side of the surface: rounding may put a `point` on the light behind it.
    #[inline]
    pub(crate) fn shadow_ray(&self, point: &SurfacePoint, sample: &LightSample) -> Option<Ray> {
        if let Some(target) = sample.target {
            // Offset from the light's surface, to the side of `point`.
            let end = target.position + target.error * target.normal;
            let heights = [end - point.position, sample.direction].map(|to| to.dot(point.geometric_normal));
            let is_before = heights[0] * heights[1] > 0.0;
            return is_before.then(|| self.ended_at_lamp(sample.light, point.spawn_to(end)));
        }
        if sample.distance < f32::INFINITY {
            return Some(point.spawn_to(point.position + sample.distance * sample.direction));
        }
        Some(point.spawn(sample.direction))
    }

    /// `ray` to a point before the lamp that is number `light`, with the end where the tracer would hit the
    /// lamp. The offset of the point is a bound for all coordinates of the scene, and may be larger than the
    /// distance of a surface before the lamp, which would then not hide it.
    #[inline]
    pub(crate) fn ended_at_lamp(&self, light: u32, ray: Ray) -> Ray {
        let shear = Shear::new(ray.direction);
        let mut end = f32::INFINITY;
        for triangle in self.lights.triangles_of(light) {
            let corners = self.scene.mesh.corners(triangle).map(|corner| corner.to_array());
            if let Some((t, ..)) = intersect(ray.origin, &shear, end, corners) {
                end = t;
            }
        }
        // At the border of the lamp the ray may miss it.
        if end < f32::INFINITY { Ray { t_max: BEFORE_LAMP * end, ..ray } } else { ray }
    }

    /// [`ShadowRays::trace`] with cut-outs: in each pass every ray advances to its next surface. Returns the
    /// number of rays that hit too many.
    #[inline(never)]
    fn trace_through_cutouts(
        &self,
        shadows: &mut ShadowRays,
        mut count: usize,
        traced: &mut u64,
        mut arrive: impl FnMut(&Ray, Rgb),
    ) -> u64 {
        let ShadowRays { rays, light, hits, .. } = shadows;
        for _ in 0..=MAX_CROSSINGS {
            if count <= FEW {
                break;
            }
            *traced += count as u64;
            self.nearest_batch(&rays[..count], Coherence::Incoherent, &mut hits[..count]);
            let mut left = 0;
            for i in 0..count {
                let (ray, contribution, hit) = (rays[i], Rgb::from(light[i]), hits[i]);
                if !hit.is_some() {
                    arrive(&ray, contribution);
                } else if let Some((rest, transmittance)) = self.pass_cutout(&ray, &hit) {
                    rays[left] = rest;
                    light[left] = (contribution * transmittance).to_array();
                    left += 1;
                }
            }
            count = left;
        }
        let mut unfinished = 0;
        for (ray, light) in rays[..count].iter().zip(&**light) {
            match self.transmit(*ray, Rgb::from(*light), traced) {
                Some(light) if light != Rgb::ZERO => arrive(ray, light),
                Some(_) => {}
                None => unfinished += 1,
            }
        }
        unfinished
    }

    /// Part of `light` that arrives along `ray` through cut-outs. `None` if the ray hits more than
    /// [`MAX_CROSSINGS`] of them. Increments `rays` per ray.
    pub(crate) fn transmit(&self, mut ray: Ray, mut light: Rgb, rays: &mut u64) -> Option<Rgb> {
        for _ in 0..=MAX_CROSSINGS {
            *rays += 1;
            let hit = self.nearest(&ray);
            if !hit.is_some() {
                return Some(light);
            }
            let Some((rest, transmittance)) = self.pass_cutout(&ray, &hit) else { return Some(Rgb::ZERO) };
            light *= transmittance;
            ray = rest;
        }
        None
    }

    /// Rest of a shadow ray behind `hit`, and the transmittance; `None` at an opaque surface.
    pub(crate) fn pass_cutout(&self, ray: &Ray, hit: &Hit) -> Option<(Ray, Rgb)> {
        // Most surfaces are opaque: leave before the surface point is computed.
        let material = self.scene.mesh.material(hit.triangle)?;
        if !self.scene.materials.get(material as usize)?.has_cutout() {
            return None;
        }
        let point = self.surface_at(ray, hit)?;
        let transmittance = self.passing(&point, ray);
        // A NaN transmits nothing.
        (transmittance.max_element() > 0.0).then(|| {
            let direction = Vec3::from(ray.direction);
            let rest = match ray.t_max {
                f32::INFINITY => point.spawn(direction),
                // Between the offset point before a lamp and the lamp: nothing else follows.
                _ if hit.t >= 1.0 => Ray::segment(point.position, direction, -1.0),
                _ => point.spawn_to(Vec3::from(ray.origin) + direction),
            };
            (Ray { tag: ray.tag, ..rest }, transmittance)
        })
    }
}
