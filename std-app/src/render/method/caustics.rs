//! Path tracing merged with caustic photons, in the program.

use super::adapter::Adapter;
use super::{Borrower, Method, Renderer, Stage, progressive_photons};
use crate::render::RenderError;
use crate::render::audit::Audit;
use crate::render::memory::{Bank, Memory};
use crate::render::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::method::caustics::{CausticPathTracing, CausticPhotons, CausticSettings, scratch};
use halflight_core::method::path::PathTracing;

/// Whether the scene can have caustics and photons are enabled.
pub(super) fn are_possible(stage: &Stage) -> bool {
    stage.settings.caustics && halflight_core::method::caustics::are_possible(stage.scene)
}

/// Allocates memory, sets up the method and calls `then` with it.
pub(super) fn with<'a, F: Features, T>(
    stage: &Stage<'a>,
    memory: &mut Memory<'a>,
    then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let Stage { settings, workers, .. } = *stage;
    let mut scratch = memory.take_each("paths", scratch::<F>(), workers.count())?;
    let context = stage.context();
    let mut executor = Threads::new(workers, &mut scratch);
    let paths = PathTracing::<F>::new(&context, settings.reuse, &mut executor)?;
    let settings = CausticSettings {
        beside_records: false,
        allows_photons_alone: settings.method.is_none() && settings.resume.is_none(),
        reserved: Audit::bytes::<F>(stage, Method::Path.is_biased()),
    };
    // Photons that do not pay release their memory.
    let bank = Bank::new();
    let mut own = memory.within(&bank);
    let method = CausticPathTracing::new(&context, paths, settings, &mut own, &mut executor)?;
    let caustics = method.as_ref().map(|method| method.finding());
    if let Some(method) = method.filter(|method| method.finding().used) {
        let done = then(&mut Adapter::<F, _>::with(stage, (Method::Path, scratch), method), &mut own);
        memory.rejoin(own);
        return done;
    }
    memory.rejoin(own);
    drop(bank);
    ["photons", "emission"].into_iter().for_each(|structure| memory.give_back(structure));
    match caustics {
        Some(caustics) => {
            let paths = CausticPathTracing::without_photons(paths, caustics);
            then(&mut Adapter::<F, _>::with(stage, (Method::Path, scratch), paths), memory)
        }
        None => {
            drop(scratch);
            memory.give_back("paths");
            then(&mut progressive_photons::<F>(stage, memory)?, memory)
        }
    }
}

/// Calls `then` with the photons that the picture has now, if any.
pub(super) fn lend(photons: Option<&mut CausticPhotons>, then: &mut Borrower) -> Result<(), RenderError> {
    match photons {
        Some(photons) => photons.lend(then)?,
        None => then(None),
    }
}
