//! Environment visibility for the program: see [`halflight_core::method::environment_visibility`].

use super::RenderError;
use super::memory::Memory;
use super::method::Stage;
use super::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::light::LightSampler;
use halflight_core::method::environment_visibility::{footprint, learn as learn_visibility, scratch};
use halflight_core::transport::{PathIntegrator, WindowGain, path::WAVE};

/// Whether the sky is sampled through windows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WindowUse {
    /// Whether it is.
    pub used: bool,
    /// What that does to the variance of its light; `None` where nobody looked.
    pub gain: Option<WindowGain>,
    /// There was no memory to look.
    pub lacks_memory: bool,
}

/// The lights of `stage`, with the visibility of the environment where there is one and that pays or is wanted.
pub(super) fn learn<'a, F: Features>(
    stage: &Stage<'a>,
    memory: &mut Memory<'a>,
) -> Result<(LightSampler<'a>, WindowUse), RenderError> {
    let Stage { lights, settings, workers, .. } = *stage;
    let wanted = settings.windows;
    if wanted == Some(false) || lights.environment_is_constant().is_none() {
        return Ok((*lights, WindowUse::default()));
    }
    // It is for speed alone: without memory for it, and for paths at the same time, the picture is made without.
    let each = scratch::<F>().and(PathIntegrator::<F>::scratch(WAVE)).bytes();
    let all = footprint().bytes().saturating_add(each.saturating_mul(workers.count()));
    if wanted.is_none() && !memory.has(all) {
        return Ok((*lights, WindowUse { lacks_memory: true, ..WindowUse::default() }));
    }
    let mut scratch = memory.take_each("look at the sky", scratch::<F>(), workers.count())?;
    let mut executor = Threads::new(workers, &mut scratch);
    let (lights, gain) = learn_visibility::<F>(&stage.context(), wanted, memory, &mut executor)?;
    memory.give_back("look at the sky");
    let used = lights.has_visibility();
    if !used {
        memory.give_back("windows");
    }
    Ok((lights, WindowUse { used, gain, lacks_memory: false }))
}
