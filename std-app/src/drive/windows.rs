//! The look from the surfaces of a scene to its sky, before the first sample: see
//! [`halflight_core::transport::Outlook`].

use super::RenderError;
use super::memory::Memory;
use super::workers::Workers;
use halflight_core::bsdf::Features;
use halflight_core::light::{EnvironmentVisibility, LightSampler};
use halflight_core::memory::{Arena, Line};
use halflight_core::transport::{Outlook, PathIntegrator, WindowGain, path::WAVE};

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

/// Learns the windows of `tracer`'s scene in `lines`, where it has a sky and they pay, or are `wanted`.
pub(super) fn learn<'m, F: Features>(
    tracer: &PathIntegrator<F>,
    lights: &LightSampler<'m>,
    wanted: Option<bool>,
    workers: &Workers,
    memory: &mut Memory,
    lines: &'m mut Vec<Line>,
) -> Result<(LightSampler<'m>, WindowUse), RenderError> {
    if wanted == Some(false) || lights.environment_is_constant().is_none() {
        return Ok((*lights, WindowUse::default()));
    }
    // They are for speed alone: where there is no memory for them, the picture is made without.
    let each = PathIntegrator::<F>::learn_scratch().and(PathIntegrator::<F>::scratch(WAVE)).bytes();
    let all = Outlook::footprint().and(EnvironmentVisibility::footprint()).bytes();
    if wanted.is_none() && !memory.has(all.saturating_add(each.saturating_mul(workers.count()))) {
        return Ok((*lights, WindowUse { lacks_memory: true, ..WindowUse::default() }));
    }
    let mut look_lines = memory.take("look at the sky", Outlook::footprint())?;
    let mut outlook = Outlook::new(&mut Arena::new(bytemuck::cast_slice_mut(&mut look_lines)))?;
    *lines = memory.take("windows", EnvironmentVisibility::footprint())?;
    let (slots, windows) = EnvironmentVisibility::memory(&mut Arena::new(bytemuck::cast_slice_mut(lines)))?;

    let mut scratch =
        memory.take_each("look at the sky", PathIntegrator::<F>::learn_scratch(), workers.count())?;
    workers.each(outlook.parts(), &mut scratch, |(task, part), _| {
        tracer.look(task, part);
        Ok(())
    })?;
    // Of what was not looked at nobody knows whether it is hidden.
    let unknown = |memory: &mut Memory| {
        ["look at the sky", "windows"].into_iter().for_each(|structure| memory.give_back(structure));
        Ok((*lights, WindowUse::default()))
    };
    if workers.watch.is_over() {
        return unknown(memory);
    }
    tracer.aim_at_sky(&mut outlook);
    let mut gain = WindowGain::default();
    let settled = outlook.settle(slots);
    if let Some((_, count)) = settled {
        let parts = windows.iter_mut().take(count).enumerate();
        let gains = workers.each(parts, &mut scratch, |(number, window), arena| {
            tracer.learn(&outlook, number, count, arena, window)
        })?;
        gains.into_iter().for_each(|other| gain += other);
    }
    if workers.watch.is_over() {
        return unknown(memory);
    }
    memory.give_back("look at the sky");
    let used = wanted.unwrap_or(gain.pays());
    let found = settled
        .filter(|_| used)
        .map(|(grid, count)| EnvironmentVisibility::new(grid, slots, &windows[..count]));
    if found.is_none() {
        memory.give_back("windows");
    }
    Ok((
        lights.with_visibility(found),
        WindowUse { used: found.is_some(), gain: Some(gain), lacks_memory: false },
    ))
}
