//! Environment visibility for the program: see [`halflight_core::method::environment_visibility`].

use super::RenderError;
use super::memory::Memory;
use super::method::Stage;
use super::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::light::LightSampler;
use halflight_core::method::environment_visibility::{footprint, learn as learn_visibility, scratch};
use halflight_core::transport::{PathIntegrator, VisibilityGain, path::WAVE};

/// Use of environment visibility.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VisibilityUse {
    /// Whether the environment is sampled by visibility tables.
    pub used: bool,
    /// Effect on the variance of its light; `None` without a prepass.
    pub gain: Option<VisibilityGain>,
    /// Whether memory for the prepass was lacking.
    pub lacks_memory: bool,
}

/// Lights of `stage`, with environment visibility if there is an environment and visibility pays or is
/// requested.
pub(super) fn learn<'a, F: Features>(
    stage: &Stage<'a>,
    memory: &mut Memory<'a>,
) -> Result<(LightSampler<'a>, VisibilityUse), RenderError> {
    let Stage { lights, settings, workers, .. } = *stage;
    let wanted = settings.environment_visibility;
    if wanted == Some(false) || lights.environment_is_constant().is_none() {
        return Ok((*lights, VisibilityUse::default()));
    }
    // Visibility only saves time: it is skipped if its tables and the memory of paths do not both fit.
    let each = scratch::<F>().and(PathIntegrator::<F>::scratch(WAVE)).bytes();
    let all = footprint().bytes().saturating_add(each.saturating_mul(workers.count()));
    if wanted.is_none() && !memory.has(all) {
        return Ok((*lights, VisibilityUse { lacks_memory: true, ..VisibilityUse::default() }));
    }
    let mut scratch = memory.take_each("look at the sky", scratch::<F>(), workers.count())?;
    let mut executor = Threads::new(workers, &mut scratch);
    let (lights, gain) = learn_visibility::<F>(&stage.context(), wanted, memory, &mut executor)?;
    memory.give_back("look at the sky");
    let used = lights.has_visibility();
    if !used {
        memory.give_back("windows");
    }
    Ok((lights, VisibilityUse { used, gain, lacks_memory: false }))
}
