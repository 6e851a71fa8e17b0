//! Reconstruction of a picture in progress: its setting, its memory, its surfaces.

use super::{Reconstruct, RenderError, Settings};
use crate::bsdf::Features;
use crate::memory::{Arena, Footprint};
use crate::method::{Executor, RenderContext};
use crate::reconstruction::{FilmReconstruction, FirstSurfaces};
use crate::scene::Scene;

/// Memory that stays taken, and memory for the search of surfaces before other structures are made.
pub(super) fn footprints<F: Features>(scene: &Scene, settings: &Settings) -> [Footprint; 2] {
    if settings.reconstruct == Reconstruct::Off {
        return Default::default();
    }
    FilmReconstruction::footprints_of_view::<F>(&scene.mesh, settings.size)
}

/// Working memory of a worker for the search of surfaces.
pub(super) fn scratch<F: Features>(settings: &Settings) -> Footprint {
    match settings.reconstruct {
        Reconstruct::Auto => FirstSurfaces::<F>::scratch(),
        Reconstruct::Off => Footprint::default(),
    }
}

/// Reconstruction of a picture, if it is wanted; `None` also if the executor is over.
pub(super) fn set_up<'a, F: Features>(
    context: &RenderContext<'a>,
    settings: &Settings,
    arena: &mut Arena<'a>,
    executor: &mut impl Executor,
) -> Result<Option<FilmReconstruction<'a>>, RenderError> {
    match settings.reconstruct {
        Reconstruct::Auto => Ok(FilmReconstruction::of_view::<F>(context, arena, executor)?),
        Reconstruct::Off => Ok(None),
    }
}
