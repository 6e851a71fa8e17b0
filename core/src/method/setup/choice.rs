//! Choice of a method for a picture whose method is left open: path tracing, unless another one has less
//! predicted error ([`crate::method::choice`]).

use super::{MethodKind, MethodPlan, MethodSetup, counts};
use crate::bsdf::Features;
use crate::census::Census;
use crate::findings::Finding;
use crate::memory::{MemorySource, OutOfMemory};
use crate::method::bidirectional::BidirectionalSettings;
use crate::method::caustics::CausticPathTracing;
use crate::method::choice::{Best, LightPaths, Trial, TrialCaches};
use crate::method::counts::Choice;
use crate::method::{Executor, RenderMethod};

/// Outcome of a choice: the plan of another method, and the reason.
pub(super) struct Chosen<'a, F> {
    pub(super) instead: Option<MethodPlan<'a, F>>,
    pub(super) finding: Finding,
}

/// The method that suits the picture, besides `paths`. `None` where time is too short for a trial.
pub(super) fn choose<'a: 'm, 'm, F: Features>(
    paths: &mut CausticPathTracing<F>,
    setup: &MethodSetup<'a, '_>,
    memory: &mut impl MemorySource<'m>,
    executor: &mut impl Executor,
) -> Result<Option<Chosen<'a, F>>, OutOfMemory> {
    let MethodSetup { context, options, goal, .. } = setup;
    if !goal.affords_trial(context.pixels()) {
        return Ok(None);
    }
    let resolution = (!setup.has_open_cache()).then(|| options.cache.resolution());
    let caches = TrialCaches { resolution, shards: setup.shards, lobes: options.lobes };
    let Some(trial) = Trial::run(context, paths, &caches, memory, executor)? else { return Ok(None) };
    // Photons of paths and caches have the light of merges, and no blur that lasts as long as the picture.
    let merging = options.bidirectional.merging.or(Some(false));
    let techniques = BidirectionalSettings { merging, ..options.bidirectional };
    let light_paths = match trial.affords_light_paths(goal) {
        true => {
            let part = goal.part_of_pilot(context.pixels());
            counts::choose::<F>(setup, (&techniques, part, trial.has_photons), memory, executor)?
        }
        false => None,
    };
    let findings = paths.findings();
    // Merges are biased, as caches are.
    let light_paths = light_paths.filter(|choice| setup.is_audited || !choice.counts.merging);
    let light_paths = light_paths.map(|choice| choice.beside(&findings));
    let found = light_paths.filter(|choice| choice.gain.is_some());
    let found =
        found.map(|Choice { noise, counts, .. }| LightPaths { noise, are_choice: counts.light_paths > 0.0 });
    let (best, finding) = trial.best(goal, setup.is_audited && may_have_cache(setup), found);
    let instead = match (best, light_paths) {
        (Best::Paths, _) | (Best::LightPaths, None) => None,
        (Best::Cache(picture), _) => Some(MethodPlan::with_cache(MethodKind::IrradianceCache, picture)),
        (Best::RadianceCache(picture), _) => Some(MethodPlan::with_cache(MethodKind::RadianceCache, picture)),
        (Best::LightPaths, Some(choice)) => {
            let merges = choice.counts.merging;
            let kind = if merges { MethodKind::VertexMerging } else { MethodKind::Bidirectional };
            Some(MethodPlan::with_counts(kind, choice))
        }
    };
    Ok(Some(Chosen { instead, finding }))
}

/// True if a cache could supply light of the scene.
fn may_have_cache(setup: &MethodSetup) -> bool {
    let surfaces = Census::of(setup.context.scene).surfaces;
    setup.context.settings.max_depth > 2 && surfaces.diffuse + surfaces.glossy > 0
}
