//! Light that a method cannot find, measured before the picture, as a part of its error.

use super::Method;
use super::RenderError;
use super::memory::Memory;
use super::setup::RenderSetup;
use super::threads::Threads;
use halflight_core::audit::MethodAtWork;
use halflight_core::bsdf::Features;
use halflight_core::findings::Findings;
use halflight_core::memory::MemorySource;
use halflight_core::method::caustics;
use halflight_core::method::hidden_light::HiddenLight;

/// Measures the light that the method of `kind` with its `findings` cannot find; `None` without any.
pub(super) fn measure<F: Features>(
    setup: &RenderSetup,
    memory: &mut Memory,
    kind: Method,
    findings: &Findings,
) -> Result<Option<HiddenLight>, RenderError> {
    let method = MethodAtWork { kind, options: &setup.settings.options(), findings };
    let (workers, scratch) = (setup.workers, MethodAtWork::scratch::<F>());
    let lent = scratch.bytes().saturating_mul(workers.count());
    if !(method.may_lack_light() && caustics::are_possible(setup.scene)) || lent > memory.available() {
        return Ok(None);
    }
    let mut own = memory.within();
    let mut scratch = own.take_each("hidden light", scratch, workers.count())?;
    let mut executor = Threads::new(workers, &mut scratch);
    let samples = setup.goal().samples;
    Ok(method.hidden_light::<F>(&setup.context(), samples, &mut own, &mut executor)?)
}
