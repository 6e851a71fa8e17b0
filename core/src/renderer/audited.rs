//! Rounds of a picture with an audit: the audit goes on alone where only its result is uncertain, and tells
//! when the requested error is out of reach.

use super::rounds::Rounds;
use crate::audit::{Audit, AuditedMethod, ErrorReport, ExtraTime};
use crate::bsdf::Features;
use crate::memory::OutOfMemory;
use crate::method::{Executor, RenderState};
use crate::reconstruction::FilmReconstruction;

/// Why samples do not lead to the requested error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutOfReach {
    /// Bias alone, which samples do not reduce, exceeds it.
    Bias,
    /// Noise shared by all samples, such as that of records, exceeds it.
    NoiseFloor,
}

impl Rounds {
    /// Focuses an audit after its first samples. Then it continues alone while only the estimate of the bias
    /// is too uncertain for an error target, and while `time` allows. Without `time` it does not continue.
    /// Returns the report with its result.
    ///
    /// # Errors
    /// Those of [`Audit::extend`].
    pub fn extend_audit<F: Features, E: Executor>(
        &self,
        (audit, method): (&mut Audit<F>, &mut (impl AuditedMethod<F> + ?Sized)),
        (state, reconstruction, report): (&RenderState, Option<&FilmReconstruction>, ErrorReport),
        time: Option<ExtraTime>,
        executor: &mut E,
    ) -> Result<ErrorReport, OutOfMemory> {
        if let Some(audited) = &report.audited {
            audit.reduce_pixels(audited, (state.counters.all_rays(), self.spp()));
        }
        let mut report = report;
        let Some(mut time) = time else { return Ok(report) };
        while report.audited.as_ref().is_some_and(|audited| self.waits_for(audited)) {
            if !audit.extend(method, &mut time, executor)? {
                break;
            }
            report = report.judged_anew(&state.film, reconstruction, audit, executor);
        }
        Ok(report)
    }

    /// Why the requested error is out of reach of a method that `converges` or not, by the newest `report`.
    pub fn out_of_reach(&mut self, report: &ErrorReport, converges: bool) -> Option<OutOfReach> {
        let has_floor = report.noise.is_some_and(|noise| self.has_floor(noise));
        let is_biased = report.audited.as_ref().is_some_and(|audited| self.is_out_of_reach(audited));
        let lacks = report.lacking.is_some_and(|lacking| self.is_below(lacking.error.lower));
        match is_biased {
            _ if lacks => Some(OutOfReach::Bias),
            _ if converges => None,
            true => Some(OutOfReach::Bias),
            false => has_floor.then_some(OutOfReach::NoiseFloor),
        }
    }
}
