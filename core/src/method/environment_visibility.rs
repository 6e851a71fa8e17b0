//! Environment visibility: before the picture, some paths and rays learn which part of the environment each
//! place sees, and the environment is then sampled by it, where that reduces variance
//! (`transport/prepass/environment_visibility.rs`).

use super::RenderContext;
use super::executor::Executor;
use crate::bsdf::Features;
use crate::light::{EnvironmentVisibility, LightSampler};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::transport::{Counters, PathIntegrator, VisibilityGain, VisibilityPrepass};

/// Bytes that [`learn`] takes.
pub fn footprint() -> Footprint {
    working().and(EnvironmentVisibility::footprint())
}

/// Working memory of a worker.
pub fn scratch<F: Features>() -> Footprint {
    PathIntegrator::<F>::learn_table_scratch()
}

fn working() -> Footprint {
    VisibilityPrepass::footprint().slice::<VisibilityGain>(EnvironmentVisibility::MAX_TABLES)
}

/// Learns the visibility of the environment of `context`, and returns its lights with it where that pays or
/// is `wanted`. The gain is `None` where the executor ended early or there is no environment.
///
/// # Errors
/// [`OutOfMemory`] where `memory` has less than [`footprint`] bytes, or the executor less than [`scratch`].
pub fn learn<'a, F: Features>(
    context: &RenderContext<'a>,
    wanted: Option<bool>,
    memory: &mut impl MemorySource<'a>,
    executor: &mut impl Executor,
) -> Result<(LightSampler<'a>, Option<VisibilityGain>), OutOfMemory> {
    let lights = context.lights;
    if lights.environment_is_constant().is_none() {
        return Ok((lights, None));
    }
    let integrator = context.integrator::<F>();
    memory.lend("look at the sky", working(), |memory, working| {
        let mut prepass = VisibilityPrepass::new(working)?;
        let gains = working.slice::<VisibilityGain>(EnvironmentVisibility::MAX_TABLES)?;
        let mut kept = memory.take("windows", EnvironmentVisibility::footprint())?;
        let (slots, tables) = EnvironmentVisibility::memory(&mut kept)?;

        let paths = context.pilots.of(integrator.visibility_paths());
        let passed = executor.pass(prepass.parts(), |_, (task, part), _| {
            integrator.store_vertices(task, paths, part);
            Ok(Counters::default())
        })?;
        // A place that was not looked at may see anything.
        if !passed.is_complete {
            return Ok((lights, None));
        }
        integrator.write_bin_directions(&mut prepass);
        let Some((grid, count)) = prepass.assign_tables(slots) else {
            return Ok((lights, Some(VisibilityGain::default())));
        };
        let rays = context.pilots.of(integrator.environment_rays()) / count.max(1);
        let pieces = tables.iter_mut().zip(gains.iter_mut()).take(count);
        let passed = executor.pass(pieces, |number, (table, gain), worker| {
            *gain = integrator.learn_table(&prepass, number, rays, &mut worker.scratch, table)?;
            Ok(Counters::default())
        })?;
        if !passed.is_complete {
            return Ok((lights, None));
        }
        let mut gain = VisibilityGain::default();
        gains.iter().take(count).for_each(|other| gain += *other);
        let tables = tables.get(..count).unwrap_or_default();
        let visibility =
            wanted.unwrap_or(gain.pays()).then(|| EnvironmentVisibility::new(grid, slots, tables));
        Ok((lights.with_visibility(visibility), Some(gain)))
    })
}
