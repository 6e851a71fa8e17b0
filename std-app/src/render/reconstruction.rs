//! Reconstruction of the core in the program: memory and threads around it.

use super::RenderError;
use super::memory::Memory;
use super::setup::RenderSetup;
use super::threads::{Threads, Workers};
use halflight_core::audit::{Audit, ErrorReport};
use halflight_core::bsdf::Features;
use halflight_core::estimate::ErrorEstimate;
use halflight_core::memory::MemorySource;
use halflight_core::method::RenderState;
use halflight_core::reconstruction::{FilmReconstruction, FirstSurfaces};
use halflight_core::renderer::Reconstruct;

/// Searches for the surfaces of the view, if the settings ask for a reconstruction and a whole picture is
/// rendered. `None` also at the end of the time.
pub(super) fn set_up<'m, 'a: 'm, F: Features>(
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'m>,
) -> Result<Option<FilmReconstruction<'m>>, RenderError> {
    let RenderSetup { scene, settings, workers, .. } = *setup;
    if settings.reconstruct == Reconstruct::Off || settings.shard.count > 1 {
        return Ok(None);
    }
    let size = [settings.width, settings.height];
    let [kept, search] = FilmReconstruction::footprints_of_view::<F>(&scene.mesh, size);
    let mut arena = MemorySource::take(memory, "reconstruction", kept.or(search))?;
    let mut scratch = memory.take_each("surfaces", FirstSurfaces::<F>::scratch(), workers.count())?;
    let mut executor = Threads::new(workers, &mut scratch);
    Ok(FilmReconstruction::of_view::<F>(&setup.context(), &mut arena, &mut executor)?)
}

/// Reconstructs the film of `state`, if that is wanted, and estimates its error with its `audit`.
pub(super) fn judge<F: Features>(
    reconstruction: &mut Option<FilmReconstruction>,
    state: &RenderState,
    audit: Option<&mut Audit<F>>,
    workers: &Workers,
) -> ErrorReport {
    workers.estimating(|executor| {
        if let Some(reconstruction) = reconstruction.as_mut() {
            let RenderState { film, is_correlated, .. } = state;
            let mean = film.mean_radiance(executor);
            let raw = mean.and_then(|mean| ErrorEstimate::of_film(film, mean, *is_correlated, executor));
            reconstruction.update(film, raw, executor);
        }
        ErrorReport::new(state, reconstruction.as_ref(), audit, executor)
    })
}

/// The reconstructed picture, row by row, if there is one.
pub(super) fn picture(made: Option<&FilmReconstruction>) -> Option<Vec<[f32; 3]>> {
    Some(made?.picture()?.map(|light| light.to_array()).collect())
}
