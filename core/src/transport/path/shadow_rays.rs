//! Shadow rays of a wave, traced after its vertices are shaded: light is added to the path then.

use super::PathTracer;
use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::transport::estimator::{Counters, MAX_CROSSINGS};
use crate::transport::path::deferred_escapes::Arrivals;
use crate::transport::path::state::Wave;
use crate::transport::walk::visibility::{FEW, pass_cutout, passing};

impl<F: Features> PathTracer<'_, F> {
    /// Adds the light at the end of the first `shadows` shadow rays to the paths of those that arrive.
    pub(super) fn trace_shadow_rays(&self, wave: &mut Wave, shadows: usize) {
        let rays = &wave.shadow_rays[..shadows];
        let hidden = &mut wave.hidden[..shadows];
        self.bvh.occluded_batch(self.level, rays, hidden);
        let mut arrivals = Arrivals::default();
        for ((ray, light), hidden) in rays.iter().zip(&*wave.shadow_light).zip(&*hidden) {
            if *hidden == 0 {
                arrivals.push(self.scene, wave.paths, ray, Rgb::from(*light));
            }
        }
        arrivals.receive(self.scene, wave.paths);
    }

    /// The same where some surfaces let a part of the light through: round after round, each ray to
    /// its next surface.
    pub(super) fn trace_shadow_rays_through_cutouts(
        &self,
        wave: &mut Wave,
        mut shadows: usize,
        counters: &mut Counters,
    ) {
        let mut arrivals = Arrivals::default();
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
                    arrivals.push(self.scene, wave.paths, &ray, light);
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
                arrivals.push(self.scene, wave.paths, ray, light);
            }
        }
        arrivals.receive(self.scene, wave.paths);
    }
}
