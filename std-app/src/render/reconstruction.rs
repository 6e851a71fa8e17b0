//! Reconstruction of the core in the program: memory and threads around it.

use super::RenderError;
use super::memory::Memory;
use super::setup::RenderSetup;
use super::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::findings::{Decision, Finding};
use halflight_core::memory::MemorySource;
use halflight_core::reconstruction::{FilmReconstruction, FirstSurfaces, LEAST_SAMPLES, TOPIC};
use halflight_core::renderer::Reconstruct;

/// Searches for the surfaces of the view, if the settings ask for a reconstruction of enough samples; `None`
/// also at the end of the time, and where memory is lacking. The film file of a shard keeps them for the
/// merged picture.
pub(super) fn set_up<'m, 'a: 'm, F: Features>(
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'m>,
    lacks_memory: &mut bool,
) -> Result<Option<FilmReconstruction<'m>>, RenderError> {
    let RenderSetup { scene, settings, workers, .. } = *setup;
    let has_few = settings.stop.spp.is_some_and(|spp| spp < LEAST_SAMPLES);
    if settings.reconstruct == Reconstruct::Off || has_few || *lacks_memory {
        return Ok(None);
    }
    let size = [settings.width, settings.height];
    let [kept, search] = FilmReconstruction::footprints_of_view::<F>(&scene.mesh, size);
    let mut take = || -> Result<_, RenderError> {
        let arena = MemorySource::take(memory, "reconstruction", kept.or(search))?;
        Ok((arena, memory.take_each("surfaces", FirstSurfaces::<F>::scratch(), workers.count())?))
    };
    let (mut arena, mut scratch) = match take() {
        Err(RenderError::Memory { .. }) => {
            *lacks_memory = true;
            return Ok(None);
        }
        taken => taken?,
    };
    let mut executor = Threads::new(workers, &mut scratch);
    Ok(FilmReconstruction::of_view::<F>(&setup.context(), &mut arena, &mut executor)?)
}

/// Finding of a picture for whose reconstruction there is too little memory.
pub(super) fn without_memory() -> Finding {
    Finding::new(TOPIC, Decision::LeftOut, "there is too little memory")
}
