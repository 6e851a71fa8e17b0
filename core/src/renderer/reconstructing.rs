//! Reconstruction of a picture in progress: its setting, its memory, its surfaces.

use super::{Reconstruct, RenderError, Settings};
use crate::bsdf::Features;
use crate::memory::{Arena, Footprint};
use crate::method::{Executor, RenderContext, Shard};
use crate::reconstruction::{FilmReconstruction, FirstSurfaces};
use crate::scene::Scene;

/// True if pictures are to be reconstructed: whole ones.
fn is_wanted(settings: &Settings) -> bool {
    settings.reconstruct == Reconstruct::Auto && settings.shard == Shard::WHOLE
}

/// Memory that stays taken, and memory for the search of surfaces before other structures are made.
pub(super) fn footprints<F: Features>(scene: &Scene, settings: &Settings) -> [Footprint; 2] {
    if !is_wanted(settings) {
        return Default::default();
    }
    FilmReconstruction::footprints_of_view::<F>(&scene.mesh, settings.size)
}

/// Working memory of a worker for the search of surfaces.
pub(super) fn scratch<F: Features>(settings: &Settings) -> Footprint {
    if is_wanted(settings) { FirstSurfaces::<F>::scratch() } else { Footprint::default() }
}

/// Reconstruction of a picture, if it is wanted; `None` also if the executor is over.
pub(super) fn set_up<'a, F: Features>(
    context: &RenderContext<'a>,
    settings: &Settings,
    arena: &mut Arena<'a>,
    executor: &mut impl Executor,
) -> Result<Option<FilmReconstruction<'a>>, RenderError> {
    match is_wanted(settings) {
        true => Ok(FilmReconstruction::of_view::<F>(context, arena, executor)?),
        false => Ok(None),
    }
}
