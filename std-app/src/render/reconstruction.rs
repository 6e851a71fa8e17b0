//! Reconstruction of the core in the program: memory and threads around it.

use super::memory::Memory;
use super::setup::RenderSetup;
use super::threads::Threads;
use super::{Method, RenderError, Settings};
use halflight_core::bsdf::Features;
use halflight_core::findings::Decision::LeftOut;
use halflight_core::findings::Finding;
use halflight_core::memory::MemorySource;
use halflight_core::reconstruction::{FilmReconstruction, FirstSurfaces, LEAST_SAMPLES, TOPIC};
use halflight_core::renderer::Reconstruct;

impl Settings {
    /// True if the picture is to be reconstructed and may have enough samples for that.
    pub(super) fn is_reconstructed(&self) -> bool {
        let has_few = self.stop.spp.is_some_and(|spp| spp < LEAST_SAMPLES);
        self.reconstruct == Reconstruct::Auto && !has_few
    }
}

/// Searches for the surfaces of the view, if the settings ask for a reconstruction of enough samples, and the
/// finding where `method` or the memory allow none. Nothing also at the end of the time. The film file of a
/// shard keeps the surfaces for the merged picture.
pub(super) fn set_up<'m, 'a: 'm, F: Features>(
    setup: &RenderSetup<'a>,
    method: Method,
    memory: &mut Memory<'m>,
) -> Result<(Option<FilmReconstruction<'m>>, Option<Finding>), RenderError> {
    let RenderSetup { scene, settings, workers, .. } = *setup;
    if !settings.is_reconstructed() {
        return Ok((None, None));
    }
    let without = |reason| Ok((None, Some(Finding::new(TOPIC, LeftOut, reason))));
    let size = [settings.width, settings.height];
    let [kept, search] = FilmReconstruction::footprints_of_view::<F>(&scene.mesh, size);
    let mut take = || -> Result<_, RenderError> {
        let arena = MemorySource::take(memory, "reconstruction", kept.or(search))?;
        Ok((arena, memory.take_each("surfaces", FirstSurfaces::<F>::scratch(), workers.count())?))
    };
    let (mut arena, mut scratch) = match take() {
        Err(RenderError::Memory { .. }) => return without("there is too little memory"),
        taken => taken?,
    };
    let mut executor = Threads::new(workers, &mut scratch);
    let made = FilmReconstruction::of_view::<F>(&setup.context(), &mut arena, &mut executor)?;
    Ok((made.map(|made| made.shared(method.has_common_errors())), None))
}
