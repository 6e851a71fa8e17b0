//! Bidirectional path tracing, light tracing, and vertex connection and merging in the program. Where light
//! paths do not pay, the picture is that of path tracing.

use super::adapter::Adapter;
use super::{Method, PhotonView, Renderer, Stage, path_tracing};
use crate::render::RenderError;

use crate::render::memory::{Bank, Memory};
use crate::render::threads::{ThreadedRound, Threads};
use halflight_core::bsdf::Features;
use halflight_core::findings::Findings;
use halflight_core::method::bidirectional::{Bidirectional, BidirectionalSettings};
use halflight_core::method::counts::{self, Choice};

/// Takes the memory for the techniques of `chosen`, sets the method up, and hands it to `then`.
pub(super) fn with<'a, F: Features, T>(
    stage: &Stage<'a>,
    memory: &mut Memory<'a>,
    chosen: Method,
    then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let given = stage.settings.bidirectional;
    let given = match chosen {
        Method::LightTracing => {
            let light_paths = given.light_paths;
            let techniques = BidirectionalSettings { light_paths, ..BidirectionalSettings::LIGHT_TRACING };
            return then(&mut paths::<F>(stage, memory, chosen, &techniques)?, memory);
        }
        Method::Bidirectional => BidirectionalSettings { merging: Some(false), ..given },
        _ => given,
    };
    let Some(choice) = choose::<F>(stage, memory, &given)? else {
        return then(&mut paths::<F>(stage, memory, chosen, &given)?, memory);
    };
    // Path tracing has means of its own: it is set up before light paths are preferred to it.
    let (choice, then) = match choice.gain {
        None if choice.counts.light_paths > 0.0 => (choice, then),
        _ => {
            let done = path_tracing::<F, _>(stage, memory, |renderer, memory| {
                let choice = choice.beside(&renderer.findings());
                if choice.counts.light_paths > 0.0 {
                    return Ok(Err((choice, then)));
                }
                then(&mut Chosen { renderer, choice, chosen }, memory).map(Ok)
            })?;
            match done {
                Ok(done) => return Ok(done),
                Err(better) => {
                    let own = ["paths", "photons", "emission"];
                    own.into_iter().for_each(|structure| memory.give_back(structure));
                    better
                }
            }
        }
    };
    let techniques = choice.settings(&given, &stage.context());
    let renderer = &mut paths::<F>(stage, memory, chosen, &techniques)?;
    then(&mut Chosen { renderer, choice, chosen }, memory)
}

/// The method `chosen` with these `techniques`.
fn paths<'a, F: Features>(
    stage: &Stage<'a>,
    memory: &mut Memory<'a>,
    chosen: Method,
    techniques: &BidirectionalSettings,
) -> Result<Adapter<'a, F, Bidirectional<'a, F>>, RenderError> {
    let scratch = (chosen, Bidirectional::<F>::scratch(techniques));
    Adapter::new(stage, memory, scratch, |memory, executor, reserve| {
        Bidirectional::new(&stage.context(), techniques, memory, executor, reserve)
    })
}

/// The counts that suit the picture, where `given` leaves them open.
fn choose<'a, F: Features>(
    stage: &Stage<'a>,
    memory: &mut Memory<'a>,
    given: &BidirectionalSettings,
) -> Result<Option<Choice>, RenderError> {
    let workers = stage.workers;
    let scratch = counts::scratch::<F>();
    if given.is_complete() || workers.count() * scratch.bytes() > memory.available() {
        return Ok(None);
    }
    // A pilot leaves no memory behind.
    let bank = Bank::new();
    let mut own = memory.within(&bank);
    let mut scratch = own.take_each("pilot paths", scratch, workers.count())?;
    let mut executor = Threads::new(workers, &mut scratch);
    let choice = counts::choose::<F>(&stage.context(), given, &mut own, &mut executor)?;
    memory.rejoin(own);
    drop(bank);
    let own = ["pilot paths", "pilot", "emission", "places", "photons"];
    own.into_iter().for_each(|structure| memory.give_back(structure));
    Ok(choice)
}

/// A method whose counts a pilot has chosen.
struct Chosen<'r> {
    renderer: &'r mut dyn Renderer,
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
