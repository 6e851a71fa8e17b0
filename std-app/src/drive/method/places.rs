//! Places that the camera sees, or that rays gather from for what it sees, in a map of their own: photons count there.

use super::Stage;
use super::photons::Drawer;
use crate::drive::RenderError;
use crate::drive::memory::Memory;
use halflight_core::bsdf::Features;
use halflight_core::memory::{Arena, Line};
use halflight_core::photon::Photon;
use halflight_core::transport::SceneContext;
use halflight_core::transport::photon_mapping::visible_points::VisiblePointSampler;

/// What their memory is counted as.
pub(super) const PLACES: &str = "places";

/// The map of the places that the rays of `raster` find.
pub(super) fn find<F: Features>(
    stage: &Stage,
    raster: &VisiblePointSampler,
    scratch: &mut [Vec<Line>],
    memory: &mut Memory,
) -> Result<Drawer, RenderError> {
    let Stage { scene, bvh, lights, settings, workers } = *stage;
    let mut places = Drawer::of(PLACES, raster.rays(), memory)?;
    let look = |task: usize, _: &mut Arena, out: &mut [Photon]| {
        Ok(raster.run(task, &SceneContext::<F>::new(scene, bvh, lights, settings.level), settings.seed, out))
    };
    places.fill_with(workers, |photons| {
        Ok(workers.look(photons, VisiblePointSampler::TASK, scratch, &look)?)
    })?;
    Ok(places)
}
