//! Methods of the core in the program: memory, threads and files around them.

mod cache_keeper;
mod photon_view;
#[cfg(test)]
mod wrong;

pub use photon_view::{MapView, PhotonView};

use super::audit::ThreadedAudit;
use super::files::RewrittenFile;
use super::memory::Memory;
use super::setup::RenderSetup;
use super::survey::Survey;
use super::threads::{ThreadedRound, Threads};
use super::{Method, RenderError, hidden_light};
use crate::save::Patience;
use cache_keeper::{CacheKeeper, LoadedCaches};
use halflight_core::audit::{AuditedMethod, Borrower, audit_fraction};
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::IrradianceCache;
use halflight_core::findings::Findings;
use halflight_core::memory::{Line, OutOfMemory};
use halflight_core::method::cached_paths::KeptCaches;
use halflight_core::method::hidden_light::HiddenLight;
use halflight_core::method::{Attempt as CoreAttempt, ChosenMethod, MethodPlan, MethodSetup, RenderMethod};
use halflight_core::transport::PathIntegrator;

/// Outcome of setting a method up.
pub(super) enum Attempt<'a, 'm, F> {
    /// The method, with its structures in memory.
    Ready(Box<Ready<'m, F>>),
    /// A prepass prefers this plan, for which the memory of the attempt is to be released first.
    Instead(Box<MethodPlan<'a, F>>),
}

/// A method with its audit.
pub(super) struct Ready<'m, F> {
    pub(super) renderer: Box<dyn Renderer<F> + 'm>,
    pub(super) audit: Option<ThreadedAudit<'m, F>>,
    /// Light that the method cannot find.
    pub(super) hidden: Option<HiddenLight>,
}

impl<'m, F: Features> Ready<'m, F> {
    /// Prepares the audit of `renderer`, and measures the light that it cannot find.
    fn with_audit<'a: 'm>(
        renderer: Box<dyn Renderer<F> + 'm>,
        setup: &RenderSetup<'a>,
        memory: &mut Memory<'m>,
    ) -> Result<Attempt<'a, 'm, F>, RenderError> {
        let method = renderer.chosen();
        let audit = ThreadedAudit::new(setup, memory, method)?;
        let hidden = hidden_light::measure::<F>(setup, memory, method, &renderer.findings())?;
        Ok(Attempt::Ready(Self { renderer, audit, hidden }.into()))
    }
}

/// Takes memory and sets up the method of `plan`.
pub(super) fn set_up<'a: 'm, 'm, F: Features>(
    plan: MethodPlan<'a, F>,
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'m>,
) -> Result<Attempt<'a, 'm, F>, RenderError> {
    let loaded = LoadedCaches::open(plan.kind(), setup, memory)?;
    let core = of_core::<F>(setup, loaded.kept());
    let core = plan.within_memory(core, setup.workers.count(), memory.available());
    let mut scratch = memory.take_each("paths", plan.scratch(&core), setup.workers.count())?;
    #[cfg(test)]
    if setup.settings.is_wrong {
        return Ready::with_audit(Box::new(wrong::Wrong::<F>::new(setup, memory)?), setup, memory);
    }
    let mut executor = Threads::new(setup.workers, &mut scratch);
    let method = match plan.set_up(&core, memory, &mut executor)? {
        CoreAttempt::Ready(method) => method,
        CoreAttempt::Instead(plan) => return Ok(Attempt::Instead(plan.into())),
    };
    let keeper = match method.cached() {
        Some(_) => Some(CacheKeeper::new::<F>(loaded, setup, memory)?),
        None => None,
    };
    Ready::with_audit(Box::new(Threaded { setup: *setup, method, scratch, keeper }), setup, memory)
}

/// Setup of a method of the core, with the records of a file.
fn of_core<'a, 's, F: Features>(setup: &RenderSetup<'a>, kept: KeptCaches<'s>) -> MethodSetup<'a, 's> {
    let settings = setup.settings;
    let keeps_records = settings.save_cache.is_some();
    MethodSetup {
        context: setup.context(),
        options: settings.options(),
        goal: setup.goal(),
        shards: settings.shard.count,
        reserve: [false, true].map(|is_biased| ThreadedAudit::<F>::bytes(setup, is_biased)),
        is_audited: audit_fraction(settings.audit, true).is_some(),
        is_reconstructed: settings.is_reconstructed(),
        kept,
        widens: !keeps_records,
        has_fixed_records: settings.load_cache.is_some() || keeps_records,
        lacks_memory: false,
    }
}

/// A method at work on one scene. It owns its structures, but not the film.
pub(super) trait Renderer<F>: AuditedMethod<F> {
    /// The method to report in films and results.
    fn chosen(&self) -> Method;

    /// One round: brings the tiles of the film to the target, or less if the round is cut.
    ///
    /// # Errors
    /// Insufficient memory.
    fn round(&mut self, round: &mut ThreadedRound) -> Result<(), RenderError>;

    /// Survey of the irradiance cache, if the settings ask for one.
    ///
    /// # Errors
    /// Insufficient memory.
    fn survey(&mut self) -> Result<Option<Survey>, RenderError> {
        Ok(None)
    }

    /// Writes the method's file for the last time.
    fn finish(&mut self, _patience: Patience) {}

    /// The file that the method writes.
    fn kept(&self) -> Option<&RewrittenFile<'_>> {
        None
    }

    /// Views of its last photon maps.
    ///
    /// # Errors
    /// Insufficient memory.
    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        Ok(None)
    }

    /// Decisions and numbers of its parts.
    fn findings(&self) -> Findings {
        Findings::default()
    }
}

/// A method of the core with working memory for each thread.
struct Threaded<'m, F> {
    setup: RenderSetup<'m>,
    method: ChosenMethod<'m, F>,
    scratch: Vec<Vec<Line>>,
    /// Keeper of its caches, if it has some.
    keeper: Option<CacheKeeper<'m>>,
}

impl<F: Features> AuditedMethod<F> for Threaded<'_, F> {
    fn lend_photons(&mut self, then: &mut Borrower) -> Result<(), OutOfMemory> {
        self.method.lend_photons(then)
    }

    fn caches(&self) -> Option<(&PathIntegrator<'_, F>, [&IrradianceCache<'_>; 2])> {
        self.method.caches()
    }
}

impl<F: Features> Renderer<F> for Threaded<'_, F> {
    fn chosen(&self) -> Method {
        self.method.kind
    }

    fn round(&mut self, round: &mut ThreadedRound) -> Result<(), RenderError> {
        let Self { method, scratch, keeper, .. } = self;
        round.run(scratch, |round| method.round(round))?;
        if let Some((keeper, cached)) = keeper.as_mut().zip(method.cached()) {
            keeper.after_round(cached);
        }
        Ok(())
    }

    fn survey(&mut self) -> Result<Option<Survey>, RenderError> {
        match self.keeper.as_mut().zip(self.method.cached()) {
            Some((keeper, cached)) => keeper.survey(cached, &self.setup),
            None => Ok(None),
        }
    }

    fn finish(&mut self, patience: Patience) {
        if let Some((keeper, cached)) = self.keeper.as_mut().zip(self.method.cached()) {
            keeper.keep(cached, Some(patience));
        }
    }

    fn kept(&self) -> Option<&RewrittenFile<'_>> {
        self.keeper.as_ref().map(|keeper| &keeper.file)
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        Ok(photon_view::render::<F>(&self.setup, &self.method.last_maps()?)?)
    }

    fn findings(&self) -> Findings {
        self.method.findings()
    }
}
