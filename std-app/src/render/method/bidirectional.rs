//! Bidirectional path tracing, light tracing, and vertex connection and merging in the program. Path tracing
//! takes their place where light paths do not pay.

use super::{Adapter, Attempt, Method, PhotonView, Plan, RenderSetup, Renderer, path};
use crate::render::RenderError;
use crate::render::memory::{Bank, Memory};
use crate::render::threads::{ThreadedRound, Threads};
use halflight_core::bsdf::Features;
use halflight_core::findings::Findings;
use halflight_core::method::Method as _;
use halflight_core::method::bidirectional::{Bidirectional, BidirectionalSettings};
use halflight_core::method::counts::{self, Choice};

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
    let choice = match plan.counts {
        Some((_, choice)) => choice,
        None => match choose::<F>(setup, memory, &given)? {
            None => return Ok(Attempt::Ready(light_paths_with::<F>(&given, setup, memory, method)?)),
            Some(choice) if choice.gain.is_none() && choice.counts.light_paths > 0.0 => choice,
            Some(choice) => return beside_paths(method, choice, setup, memory),
        },
    };
    let techniques = choice.settings(&given, &setup.context());
    let renderer = light_paths_with::<F>(&techniques, setup, memory, method)?;
    Ok(Attempt::Ready(chosen(method, choice, renderer)))
}

/// Path tracing with all of its means, unless `method` with the counts of `choice` pays beside them.
fn beside_paths<'a: 'm, 'm, F: Features>(
    method: Method,
    choice: Choice,
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'m>,
) -> Result<Attempt<'a, 'm, F>, RenderError> {
    let paths = path::set_up(setup, memory, None)?;
    let choice = choice.beside(&match &paths {
        Attempt::Ready(renderer) => renderer.findings(),
        Attempt::Instead(plan) => plan.paths.as_ref().map(|paths| paths.findings()).unwrap_or_default(),
    });
    let counts = Some((method, choice));
    Ok(match paths {
        _ if choice.counts.light_paths > 0.0 => Attempt::Instead(Plan { method, paths: None, counts }),
        Attempt::Ready(renderer) => Attempt::Ready(chosen(method, choice, renderer)),
        Attempt::Instead(plan) => Attempt::Instead(Plan { counts, ..plan }),
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

/// The counts that suit the picture, where `given` leaves them open.
fn choose<F: Features>(
    setup: &RenderSetup,
    memory: &mut Memory,
    given: &BidirectionalSettings,
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
    let choice = counts::choose::<F>(&setup.context(), given, &mut own, &mut executor)?;
    memory.release(&own);
    Ok(choice)
}

/// `renderer` in the place of the method `chosen`, after its `choice` of counts.
pub(super) fn chosen<'m>(
    chosen: Method,
    choice: Choice,
    renderer: Box<dyn Renderer + 'm>,
) -> Box<dyn Renderer + 'm> {
    Box::new(Chosen { renderer, choice, chosen })
}

/// A method whose counts a pilot has chosen.
struct Chosen<'m> {
    renderer: Box<dyn Renderer + 'm>,
    choice: Choice,
    chosen: Method,
}

impl Renderer for Chosen<'_> {
    fn chosen(&self) -> Method {
        self.chosen
    }

    fn round(&mut self, round: &mut ThreadedRound) -> Result<(), RenderError> {
        self.renderer.round(round)
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        self.renderer.photon_view()
    }

    fn findings(&self) -> Findings {
        self.choice.findings().and(self.renderer.findings())
    }
}
