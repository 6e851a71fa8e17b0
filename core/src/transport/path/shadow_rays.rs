//! Shadow rays of a wave, traced after its vertices are shaded: light is added to the path then.

use super::PathIntegrator;
use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::geometry::Ray;
use crate::scene::Scene;
use crate::transport::estimator::{Counters, MAX_CROSSINGS};
use crate::transport::path::state::{PathState, Wavefront};
use crate::transport::walk::visibility::{FEW, pass_cutout, passing};

/// In the tag of a shadow ray: it goes to the environment, whose radiance is looked up when it has arrived. Most are
/// hidden, and a map is large.
pub(super) const TO_ENVIRONMENT: u32 = 1 << 31;

/// Adds the light at the end of shadow ray `ray`, which met nothing, to its path.
#[inline]
fn arrive(scene: &Scene, paths: &mut [PathState], ray: &Ray, light: Rgb) {
    let environment = scene.environment.as_ref().filter(|_| ray.tag & TO_ENVIRONMENT != 0);
    let radiance = environment.map_or(Rgb::ONE, |e| e.radiance(scene, ray.direction.into()));
    if let Some(path) = paths.get_mut((ray.tag & !TO_ENVIRONMENT) as usize) {
        path.add(light * radiance);
    }
}

/// Shadow rays, and what arrives at the camera from each if nothing is in its way.
pub(super) struct Shadows<'w> {
    pub(super) rays: &'w mut [Ray],
    pub(super) light: &'w mut [[f32; 3]],
    pub(super) count: usize,
}

impl Shadows<'_> {
    #[inline]
    pub(super) fn push(&mut self, ray: Ray, light: Rgb) {
        if let (Some(slot), Some(arrives)) = (self.rays.get_mut(self.count), self.light.get_mut(self.count)) {
            (*slot, *arrives) = (ray, light.to_array());
            self.count += 1;
        }
    }
}

impl<F: Features> PathIntegrator<'_, F> {
    /// Adds the light at the end of the first `shadows` shadow rays to the paths of those that arrive.
    pub(super) fn trace_shadow_rays(&self, wave: &mut Wavefront, shadows: usize) {
        let rays = &wave.shadow_rays[..shadows];
        let hidden = &mut wave.hidden[..shadows];
        self.bvh.occluded_batch(self.level, rays, hidden);
        for ((ray, light), hidden) in rays.iter().zip(&*wave.shadow_light).zip(&*hidden) {
            if *hidden == 0 {
                arrive(self.scene, wave.paths, ray, Rgb::from(*light));
            }
        }
    }

    /// The same where some surfaces let a part of the light through: round after round, each ray to
    /// its next surface.
    pub(super) fn trace_shadow_rays_through_cutouts(
        &self,
        wave: &mut Wavefront,
        mut shadows: usize,
        counters: &mut Counters,
    ) {
        for _ in 0..=MAX_CROSSINGS {
            if shadows <= FEW {
                break;
            }
            counters.shadow_rays += shadows as u64;
            let rays = &wave.shadow_rays[..shadows];
            let hits = &mut wave.hits[..shadows];
            self.bvh.nearest_batch(self.level, rays, Coherence::Incoherent, hits);
            let mut left = 0;
            for i in 0..shadows {
                let (ray, light) = (wave.shadow_rays[i], Rgb::from(wave.shadow_light[i]));
                let hit = wave.hits[i];
                if !hit.is_some() {
                    arrive(self.scene, wave.paths, &ray, light);
                } else if let Some((through, transmittance)) = pass_cutout::<F>(self.scene, &ray, &hit) {
                    wave.shadow_rays[left] = through;
                    wave.shadow_light[left] = (light * transmittance).to_array();
                    left += 1;
                }
            }
            shadows = left;
        }
        for (ray, light) in wave.shadow_rays[..shadows].iter().zip(&*wave.shadow_light) {
            let rays = &mut counters.shadow_rays;
            let light = passing::<F>(self.scene, self.bvh, self.level, *ray, Rgb::from(*light), rays);
            counters.dropped.unfinished += u64::from(light.is_none());
            if let Some(light) = light.filter(|light| *light != Rgb::ZERO) {
                arrive(self.scene, wave.paths, ray, light);
            }
        }
    }
}
