//! Environment visibility for the program: see [`halflight_core::method::environment_visibility`].

use super::RenderError;
use super::memory::Memory;
use super::setup::RenderSetup;
use super::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::findings::Decision::{LeftOut, Used};
use halflight_core::findings::{Finding, Value};
use halflight_core::light::LightSampler;
use halflight_core::method::environment_visibility::{footprint, learn as learn_visibility, scratch};
use halflight_core::transport::{PathIntegrator, path::WAVE};

/// Lights of `setup`, with environment visibility if there is an environment and visibility pays or is
/// requested.
pub(super) fn learn<'a, F: Features>(
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'a>,
) -> Result<(LightSampler<'a>, Option<Finding>), RenderError> {
    let RenderSetup { lights, settings, workers, .. } = *setup;
    let wanted = settings.environment_visibility;
    if wanted == Some(false) || lights.environment_is_constant().is_none() {
        return Ok((lights, None));
    }
    // Visibility only saves time: it is skipped if its tables and the memory of paths do not both fit.
    let each = scratch::<F>().and(PathIntegrator::<F>::scratch(WAVE)).bytes();
    let all = footprint().bytes().saturating_add(each.saturating_mul(workers.count()));
    if wanted.is_none() && !memory.has(all) {
        let reason = "not enough memory: sky light may be noisier";
        return Ok((lights, Some(Finding::new("environment_visibility", LeftOut, reason))));
    }
    let mut scratch = memory.take_each("look at the sky", scratch::<F>(), workers.count())?;
    let mut executor = Threads::new(workers, &mut scratch);
    let (lights, gain) = learn_visibility::<F>(&setup.context(), wanted, memory, &mut executor)?;
    memory.give_back("look at the sky");
    let used = lights.has_visibility();
    if !used {
        memory.give_back("windows");
    }
    let (decision, reason) = match used {
        true => (Used, "the environment is sampled by its visibility"),
        false => (LeftOut, "most of the environment is visible from everywhere"),
    };
    let finding = Finding::new("environment_visibility", decision, reason);
    Ok((lights, gain.map(|gain| finding.with("gain", Value::Number(gain.factor().into())))))
}
