//! Path tracing merged with caustic photons, in the program.

use super::path::Paths;
use super::photon_view::{self, PhotonView};
use super::sppm::ProgressivePhotons;
use super::{Borrower, Method, Renderer, Stage};
use crate::render::audit::Audit;
use crate::render::crew::Crew;
use crate::render::memory::{Bank, Memory};
use crate::render::threads::Threads;
use crate::render::{RenderError, Reuse};
use halflight_core::bsdf::Features;
use halflight_core::memory::Line;
use halflight_core::method::caustics::{
    CausticPathTracing, CausticPhotons, CausticSettings, CausticUse, scratch,
};
use halflight_core::method::path::PathTracing;
use halflight_core::method::{Method as _, PhotonUse};

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
        let done = then(&mut Joined { stage: *stage, method, scratch }, &mut own);
        memory.rejoin(own);
        return done;
    }
    memory.rejoin(own);
    drop(bank);
    ["photons", "emission"].into_iter().for_each(|structure| memory.give_back(structure));
    match caustics {
        Some(caustics) => then(&mut Paths { method: paths, scratch, caustics }, memory),
        None => {
            drop(scratch);
            memory.give_back("paths");
            then(&mut ProgressivePhotons::<F>::new(stage, memory)?, memory)
        }
    }
}

/// View of the last map of `photons`.
pub(super) fn view<F: Features>(
    stage: &Stage,
    photons: &mut CausticPhotons,
) -> Result<Option<PhotonView>, RenderError> {
    let Some(map) = photons.last_map()? else { return Ok(None) };
    Ok(Some(photon_view::look::<F>(stage, None, Some(&map))?))
}

/// Calls `then` with the photons that the picture has now, if any.
pub(super) fn lend(photons: Option<&mut CausticPhotons>, then: &mut Borrower) -> Result<(), RenderError> {
    match photons {
        Some(photons) => photons.lend(then)?,
        None => then(None),
    }
}

/// Path tracing merged with photons.
struct Joined<'a, F> {
    stage: Stage<'a>,
    method: CausticPathTracing<'a, F>,
    scratch: Vec<Vec<Line>>,
}

impl<F: Features> Renderer for Joined<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        Ok(crew.round(&mut self.scratch, |round| self.method.round(round))?)
    }

    fn reuse(&self) -> Reuse {
        self.method.reuse()
    }

    fn caustics(&self) -> CausticUse {
        self.method.finding()
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        let Self { stage, method, .. } = self;
        method.photons().map_or(Ok(None), |photons| view::<F>(stage, photons))
    }

    fn photons(&self) -> Option<PhotonUse> {
        self.method.statistics()
    }
}
