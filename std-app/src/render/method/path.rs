//! Path tracing with all of its means in the program: path reuse and caustic photons.

use super::choice::{Chosen, choose};
use super::prepared::Prepared;
use super::{Adapter, Attempt, Borrower, Method, Plan, RenderSetup};
use crate::render::RenderError;
use crate::render::audit::Audit;
use crate::render::memory::Memory;
use crate::render::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::findings::Findings;
use halflight_core::method;
use halflight_core::method::caustics::{CausticPathTracing, CausticPhotons, CausticSettings, CausticUse};
use halflight_core::method::path::PathTracing;

/// Whether the scene can have caustics and photons are enabled.
pub(super) fn are_possible(setup: &RenderSetup) -> bool {
    setup.settings.caustics && halflight_core::method::caustics::are_possible(setup.scene)
}

/// Sets up path tracing, with caustic photons if they pay; with the paths of `plan` alone if a prepass has
/// made them. Photons that do not pay release their memory. Where the plan is open, another method may take
/// its place.
pub(super) fn set_up<'a: 'm, 'm, F: Features>(
    plan: Plan<'a, F>,
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'m>,
) -> Result<Attempt<'a, 'm, F>, RenderError> {
    let RenderSetup { settings, workers, .. } = *setup;
    let context = setup.context();
    let has_prepass = plan.paths.is_none() && are_possible(setup);
    let scratch = match (has_prepass || plan.paths.is_some(), plan.is_open) {
        (_, true) => method::choice::scratch::<F>(),
        (true, _) => method::caustics::scratch::<F>(),
        (false, _) => PathTracing::<F>::scratch(),
    };
    let mut scratch = memory.take_each("paths", scratch, workers.count())?;
    if let Some(paths) = plan.paths {
        let paths = Adapter::<F, _>::with(setup, (Method::Path, scratch), *paths);
        return Ok(Attempt::Ready(Box::new(paths)));
    }
    let mut executor = Threads::new(workers, &mut scratch);
    let paths = PathTracing::<F>::new(&context, settings.reuse, &mut executor)?;
    let mut method = match has_prepass {
        false => CausticPathTracing::without_photons(paths, CausticUse::default()),
        true => {
            let settings = CausticSettings {
                beside_records: false,
                most_rays: setup.most_rays(),
                reserved: Audit::bytes::<F>(setup, Method::Path.is_biased()),
            };
            CausticPathTracing::new(&context, paths, settings, memory, &mut executor)?
        }
    };
    let caustics = method.finding();
    let mut findings = Findings::default();
    if plan.is_open
        && let Some(Chosen { instead, finding }) = choose(&mut method, setup, memory, &mut executor)?
    {
        findings = finding.into();
        if let Some(plan) = instead {
            return Ok(Attempt::Instead(Box::new(Plan { findings: findings.and(plan.findings), ..plan })));
        }
    }
    if has_prepass && !caustics.used {
        let paths = Some(Box::new(CausticPathTracing::without_photons(paths, caustics)));
        return Ok(Attempt::Instead(Box::new(Plan { paths, findings, ..Method::Path.into() })));
    }
    let renderer = Box::new(Adapter::<F, _>::with(setup, (Method::Path, scratch), method));
    Ok(Attempt::Ready(match plan.is_open {
        true => Box::new(Prepared { renderer, reported: Method::Path, findings }),
        false => renderer,
    }))
}

/// Calls `then` with the photons that the picture has now, if any.
pub(super) fn lend(photons: Option<&mut CausticPhotons>, then: &mut Borrower) -> Result<(), RenderError> {
    match photons {
        Some(photons) => photons.lend(then)?,
        None => then(None),
    }
}
