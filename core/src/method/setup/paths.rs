//! Setup of path tracing with all of its means: path reuse and caustic photons. Where the plan is open,
//! another method may take its place.

use super::choice::{Chosen, choose};
use super::{AnyMethod, Attempt, MethodKind, MethodPlan, MethodSetup};
use crate::bsdf::Features;
use crate::memory::{MemorySource, OutOfMemory};
use crate::method::Executor;
use crate::method::caustics::{CausticPathTracing, CausticSettings};
use crate::method::path::PathTracing;

/// Path tracing, with caustic photons if they pay; with the paths of `plan` alone if a prepass has made them.
/// Photons that do not pay leave their memory to another attempt.
pub(super) fn set_up<'a: 'm, 'm, F: Features>(
    plan: MethodPlan<'a, F>,
    setup: &MethodSetup<'a, '_>,
    memory: &mut impl MemorySource<'m>,
    executor: &mut impl Executor,
) -> Result<Attempt<'a, 'm, F>, OutOfMemory> {
    if let Some((paths, caustics)) = plan.paths {
        let paths = CausticPathTracing::without_photons(paths, caustics);
        return Ok(Attempt::Ready(plan.chosen(AnyMethod::Paths(paths))));
    }
    let has_prepass = setup.may_have_caustics();
    let paths = PathTracing::<F>::new(&setup.context, setup.options.paths.reuse, executor)?;
    let mut method = match has_prepass {
        false => CausticPathTracing::without_photons(paths, setup.without_prepass()),
        true => {
            let settings = CausticSettings {
                beside_records: false,
                most_rays: setup.goal.rays,
                reserved: setup.reserve(MethodKind::Path),
            };
            CausticPathTracing::new(&setup.context, paths, settings, memory, executor)?
        }
    };
    let caustics = method.finding();
    let mut findings = plan.findings;
    if plan.is_open
        && let Some(Chosen { instead, finding }) = choose(&mut method, setup, memory, executor)?
    {
        findings = findings.and(Some(finding));
        if let Some(plan) = instead {
            return Ok(Attempt::Instead(MethodPlan { findings: findings.and(plan.findings), ..plan }));
        }
    }
    let plan = MethodPlan { findings, is_open: false, ..plan };
    match has_prepass && !caustics.used {
        true => Ok(Attempt::Instead(MethodPlan { paths: Some((paths, caustics)), ..plan })),
        false => Ok(Attempt::Ready(plan.chosen(AnyMethod::Paths(method)))),
    }
}
