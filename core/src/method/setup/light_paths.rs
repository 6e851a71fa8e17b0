//! Setup of bidirectional path tracing, light tracing, and vertex connection and merging. Path tracing takes
//! their place where light paths do not pay.

use super::{AnyMethod, Attempt, MethodKind, MethodPlan, MethodSetup, paths};
use crate::bsdf::Features;
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::method::bidirectional::Bidirectional;
use crate::method::counts::{self, Choice, pilot};
use crate::method::{Executor, RenderMethod};

/// Working memory of a worker for `plan`.
pub(super) fn scratch<F: Features>(plan: &MethodPlan<F>, setup: &MethodSetup) -> Footprint {
    let given = setup.options.bidirectional.of(plan.kind);
    match plan.counts {
        Some(choice) => Bidirectional::<F>::scratch(&choice.settings(&given, &setup.context)),
        None if plan.kind == MethodKind::LightTracing => Bidirectional::<F>::scratch(&given),
        None => {
            let of_paths = MethodPlan::<F>::from(MethodKind::Path).scratch(setup);
            Bidirectional::<F>::scratch(&given).or(counts::scratch::<F>()).or(of_paths)
        }
    }
}

/// Sets up the method of `plan`, or path tracing with all of its means where that has less noise for the
/// work.
pub(super) fn set_up<'a: 'm, 'm, F: Features>(
    plan: MethodPlan<'a, F>,
    setup: &MethodSetup<'a, '_>,
    memory: &mut impl MemorySource<'m>,
    executor: &mut impl Executor,
) -> Result<Attempt<'a, 'm, F>, OutOfMemory> {
    let kind = plan.kind;
    let given = setup.options.bidirectional.of(kind);
    let mut techniques = given;
    if let Some(choice) = plan.counts.filter(|_| kind != MethodKind::LightTracing) {
        techniques = choice.settings(&given, &setup.context);
    } else if kind != MethodKind::LightTracing {
        let pilot = (&given, pilot::PART, false);
        let choice = counts::choose::<F>(&setup.context, pilot, &mut memory.within(), executor)?;
        match choice {
            None => (),
            Some(choice) if choice.gain.is_none() && choice.counts.light_paths > 0.0 => {
                return Ok(Attempt::Instead(MethodPlan::with_counts(kind, choice)));
            }
            Some(choice) => return beside_paths(kind, choice, setup, memory, executor),
        }
    }
    let reserve = setup.reserve(kind);
    let method = Bidirectional::new(&setup.context, &techniques, memory, executor, reserve)?;
    Ok(Attempt::Ready(plan.chosen(AnyMethod::LightPaths(method))))
}

/// Path tracing with all of its means, unless the method of `kind` with the counts of `choice` pays beside
/// them.
fn beside_paths<'a: 'm, 'm, F: Features>(
    kind: MethodKind,
    choice: Choice,
    setup: &MethodSetup<'a, '_>,
    memory: &mut impl MemorySource<'m>,
    executor: &mut impl Executor,
) -> Result<Attempt<'a, 'm, F>, OutOfMemory> {
    let paths = paths::set_up(MethodKind::Path.into(), setup, memory, executor)?;
    let choice = choice.beside(&match &paths {
        Attempt::Ready(chosen) => chosen.findings(),
        Attempt::Instead(plan) => plan.findings_of_paths(),
    });
    let findings = choice.findings();
    Ok(match paths {
        _ if choice.counts.light_paths > 0.0 => Attempt::Instead(MethodPlan::with_counts(kind, choice)),
        Attempt::Ready(chosen) => Attempt::Ready(super::ChosenMethod { kind, findings, ..chosen }),
        Attempt::Instead(plan) => Attempt::Instead(MethodPlan { reported: kind, findings, ..plan }),
    })
}
