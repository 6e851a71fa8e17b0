//! Shadow rays of a wave, traced after its vertices are shaded: light is added to the path then.

use super::PathIntegrator;
use crate::Rgb;
use crate::bsdf::Features;
use crate::geometry::Ray;
use crate::scene::Scene;
use crate::transport::estimator::Counters;
use crate::transport::path::state::{PathState, Wavefront};
use crate::transport::walk::visibility::ShadowRays;

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
    pub(super) fn trace_shadow_rays(&self, wave: &mut Wavefront, shadows: usize, counters: &mut Counters) {
        let Wavefront { paths, shadow_rays: rays, shadow_light: light, hits, hidden, .. } = wave;
        let mut queue = ShadowRays { rays, light, hits, hidden };
        let arrive = |ray: &Ray, light| arrive(self.context.scene, paths, ray, light);
        counters.dropped.unfinished +=
            self.context.trace_shadow_rays(&mut queue, shadows, &mut counters.shadow_rays, arrive);
    }
}
