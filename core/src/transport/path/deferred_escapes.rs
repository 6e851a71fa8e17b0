//! Light at the end of shadow rays that met nothing, on its way into the paths that asked for it.

use crate::Rgb;
use crate::geometry::Ray;
use crate::scene::Scene;
use crate::transport::path::BLOCK;
use crate::transport::path::state::Path;
use glam::Vec2;

/// In the tag of a shadow ray: it goes to the environment, whose radiance is looked up when it has arrived. Most are
/// hidden, and a map is large.
pub(in crate::transport) const TO_ENVIRONMENT: u32 = 1 << 31;

/// Light that has arrived and is about to be added to its paths. What comes from a map is looked up for several at
/// once, after all of it has been asked for.
#[derive(Default)]
pub(in crate::transport) struct Arrivals {
    count: usize,
    /// Path, place on the map where light comes from there, what it is multiplied with.
    light: [(u32, Vec2, Rgb); BLOCK],
}

impl Arrivals {
    #[inline]
    pub(in crate::transport) fn push(&mut self, scene: &Scene, paths: &mut [Path], ray: &Ray, light: Rgb) {
        let environment = scene.environment.as_ref().filter(|_| ray.tag & TO_ENVIRONMENT != 0);
        let place = environment.map_or(Vec2::ZERO, |e| e.place(scene, ray.direction.into()));
        if let Some(slot) = self.light.get_mut(self.count) {
            *slot = (ray.tag, place, light);
            self.count += 1;
        }
        if self.count == BLOCK {
            self.receive(scene, paths);
        }
    }

    pub(in crate::transport) fn receive(&mut self, scene: &Scene, paths: &mut [Path]) {
        for (tag, place, light) in self.light.into_iter().take(self.count) {
            let environment = scene.environment.as_ref().filter(|_| tag & TO_ENVIRONMENT != 0);
            let radiance = environment.map_or(Rgb::ONE, |e| e.radiance_at(scene, place));
            if let Some(path) = paths.get_mut((tag & !TO_ENVIRONMENT) as usize) {
                path.add(light * radiance);
            }
        }
        self.count = 0;
    }
}
