//! Path tracing with all of its means in the program: path reuse and caustic photons.

use super::{Adapter, Attempt, Borrower, Method, Plan, RenderSetup};
use crate::render::RenderError;
use crate::render::audit::Audit;
use crate::render::memory::Memory;
use crate::render::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::method::caustics::{CausticPathTracing, CausticPhotons, CausticSettings, scratch};
use halflight_core::method::path::PathTracing;

/// Whether the scene can have caustics and photons are enabled.
pub(super) fn are_possible(setup: &RenderSetup) -> bool {
    setup.settings.caustics && halflight_core::method::caustics::are_possible(setup.scene)
}

/// Sets up path tracing, with caustic photons if they pay; with `paths` alone if a prepass has made them.
/// Photons that do not pay release their memory.
pub(super) fn set_up<'a: 'm, 'm, F: Features>(
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'m>,
    paths: Option<Box<CausticPathTracing<'a, F>>>,
) -> Result<Attempt<'a, 'm, F>, RenderError> {
    let RenderSetup { settings, workers, .. } = *setup;
    let context = setup.context();
    if paths.is_none() && !are_possible(setup) {
        let scratch = (Method::Path, PathTracing::<F>::scratch());
        let paths = Adapter::<F, _>::boxed(setup, memory, scratch, |_, executor, _| {
            PathTracing::<F>::new(&context, settings.reuse, executor)
        })?;
        return Ok(Attempt::Ready(paths));
    }
    let mut scratch = memory.take_each("paths", scratch::<F>(), workers.count())?;
    if let Some(paths) = paths {
        let paths = Adapter::<F, _>::with(setup, (Method::Path, scratch), *paths);
        return Ok(Attempt::Ready(Box::new(paths)));
    }
    let mut executor = Threads::new(workers, &mut scratch);
    let paths = PathTracing::<F>::new(&context, settings.reuse, &mut executor)?;
    let settings = CausticSettings {
        beside_records: false,
        allows_photons_alone: settings.method.is_none() && settings.resume.is_none(),
        reserved: Audit::bytes::<F>(setup, Method::Path.is_biased()),
    };
    let Some(method) = CausticPathTracing::new(&context, paths, settings, memory, &mut executor)? else {
        return Ok(Attempt::Instead(Method::ProgressivePhotons.into()));
    };
    let caustics = method.finding();
    if caustics.used {
        let method = Adapter::<F, _>::with(setup, (Method::Path, scratch), method);
        return Ok(Attempt::Ready(Box::new(method)));
    }
    let paths = Some(Box::new(CausticPathTracing::without_photons(paths, caustics)));
    Ok(Attempt::Instead(Plan { method: Method::Path, paths, counts: None }))
}

/// Calls `then` with the photons that the picture has now, if any.
pub(super) fn lend(photons: Option<&mut CausticPhotons>, then: &mut Borrower) -> Result<(), RenderError> {
    match photons {
        Some(photons) => photons.lend(then)?,
        None => then(None),
    }
}
