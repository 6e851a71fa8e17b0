//! Audit of the core in the program: memory and threads around it.

use super::Method;
use super::RenderError;
use super::deadline::End;
use super::memory::Memory;
use super::setup::RenderSetup;
use super::threads::{Threads, Workers};
use halflight_core::audit::{Audit, AuditSettings, audit_fraction};
use halflight_core::bsdf::Features;
use halflight_core::memory::Line;

/// An audit with working memory for each thread.
pub(super) struct ThreadedAudit<'m, F> {
    pub(super) audit: Audit<'m, F>,
    scratch: Vec<Vec<Line>>,
}

impl<'m, F: Features> ThreadedAudit<'m, F> {
    /// Sets up the audit that the settings ask for.
    pub(super) fn new<'a: 'm>(
        setup: &RenderSetup<'a>,
        memory: &mut Memory<'m>,
        method: Method,
    ) -> Result<Option<Self>, RenderError> {
        let RenderSetup { settings, workers, .. } = *setup;
        let Some(fraction) = audit_fraction(settings.audit, method.is_biased()) else { return Ok(None) };
        let by_clock = settings.stop.error.is_none();
        let settings = AuditSettings { fraction, shard: settings.shard, by_clock };
        let mut scratch = memory.take_each("audit", Audit::<F>::scratch(), workers.count())?;
        let mut executor = Threads::new(workers, &mut scratch);
        let audit = Audit::new(&setup.context(), method, settings, memory, &mut executor)?;
        Ok(Some(Self { audit, scratch }))
    }

    /// Bytes that the audit will take; methods that take all available memory leave them free.
    pub(super) fn bytes(setup: &RenderSetup, is_biased: bool) -> usize {
        let RenderSetup { settings, workers, lights, .. } = *setup;
        if audit_fraction(settings.audit, is_biased).is_none() {
            return 0;
        }
        let size = [settings.width, settings.height];
        let threads = Audit::<F>::scratch().bytes().saturating_mul(workers.count());
        threads.saturating_add(Audit::<F>::reserve(size, lights.count(), is_biased).bytes())
    }

    /// The audit, and an executor for its samples, which end where the user interrupts.
    pub(super) fn at_work<'t>(&'t mut self, workers: &'t Workers) -> (&'t mut Audit<'m, F>, Threads<'t>) {
        (&mut self.audit, Threads::new(workers, &mut self.scratch).until(End::Round(None)))
    }
}

#[cfg(test)]
mod tests;
