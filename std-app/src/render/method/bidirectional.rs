//! Bidirectional path tracing, light tracing, and vertex connection and merging in the program. Path tracing
//! takes their place where light paths do not pay.

use super::prepared::Prepared;
use super::{Adapter, Attempt, Method, Plan, RenderSetup, Renderer, path};
use crate::render::RenderError;
use crate::render::memory::{Bank, Memory};
use crate::render::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::method::Method as _;
use halflight_core::method::bidirectional::{Bidirectional, BidirectionalSettings};
use halflight_core::method::counts::{self, Choice, pilot};

/// Sets up the method of `plan`, or path tracing with all of its means where that has less noise for the
/// work.
pub(super) fn set_up<'a: 'm, 'm, F: Features>(
    plan: Plan<'a, F>,
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'m>,
) -> Result<Attempt<'a, 'm, F>, RenderError> {
    let method = plan.method;
    let given = setup.settings.bidirectional;
    let given = match method {
        Method::LightTracing => {
            let light_paths = given.light_paths;
            let techniques = BidirectionalSettings { light_paths, ..BidirectionalSettings::LIGHT_TRACING };
            return Ok(Attempt::Ready(light_paths_with::<F>(&techniques, setup, memory, method)?));
        }
        Method::Bidirectional => BidirectionalSettings { merging: Some(false), ..given },
        _ => given,
    };
    if let Some(choice) = plan.counts {
        let techniques = choice.settings(&given, &setup.context());
        return Ok(Attempt::Ready(light_paths_with::<F>(&techniques, setup, memory, method)?));
    }
    match choose::<F>(setup, memory, (&given, pilot::PART, false))? {
        None => Ok(Attempt::Ready(light_paths_with::<F>(&given, setup, memory, method)?)),
        Some(choice) if choice.gain.is_none() && choice.counts.light_paths > 0.0 => {
            Ok(Attempt::Instead(Plan::with_counts(method, choice).into()))
        }
        Some(choice) => beside_paths(method, choice, setup, memory),
    }
}

/// Path tracing with all of its means, unless `method` with the counts of `choice` pays beside them.
fn beside_paths<'a: 'm, 'm, F: Features>(
    method: Method,
    choice: Choice,
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'m>,
) -> Result<Attempt<'a, 'm, F>, RenderError> {
    let paths = path::set_up(Method::Path.into(), setup, memory)?;
    let choice = choice.beside(&match &paths {
        Attempt::Ready(renderer) => renderer.findings(),
        Attempt::Instead(plan) => plan.paths.as_ref().map(|paths| paths.findings()).unwrap_or_default(),
    });
    Ok(match paths {
        _ if choice.counts.light_paths > 0.0 => Attempt::Instead(Plan::with_counts(method, choice).into()),
        Attempt::Ready(renderer) => {
            Attempt::Ready(Box::new(Prepared { renderer, reported: method, findings: choice.findings() }))
        }
        Attempt::Instead(plan) => {
            Attempt::Instead(Box::new(Plan { reported: method, findings: choice.findings(), ..*plan }))
        }
    })
}

/// `method` with these `techniques`.
fn light_paths_with<'a: 'm, 'm, F: Features>(
    techniques: &BidirectionalSettings,
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'m>,
    method: Method,
) -> Result<Box<dyn Renderer + 'm>, RenderError> {
    let scratch = (method, Bidirectional::<F>::scratch(techniques));
    Adapter::<F, _>::boxed(setup, memory, scratch, |memory, executor, reserve| {
        Bidirectional::<F>::new(&setup.context(), techniques, memory, executor, reserve)
    })
}

/// The counts that suit the picture, where `given` leaves them open, by a pilot with one pixel for each
/// `part` of the picture.
pub(super) fn choose<F: Features>(
    setup: &RenderSetup,
    memory: &mut Memory,
    (given, part, has_photons): (&BidirectionalSettings, usize, bool),
) -> Result<Option<Choice>, RenderError> {
    let workers = setup.workers;
    let scratch = counts::scratch::<F>();
    if given.is_complete() || workers.count() * scratch.bytes() > memory.available() {
        return Ok(None);
    }
    let bank = Bank::new();
    let mut own = memory.within(&bank);
    let mut scratch = own.take_each("pilot paths", scratch, workers.count())?;
    let mut executor = Threads::new(workers, &mut scratch);
    let choice = counts::choose::<F>(&setup.context(), (given, part, has_photons), &mut own, &mut executor)?;
    memory.release(&own);
    Ok(choice)
}
