//! Choice of a method for a picture whose method is left open: path tracing, unless another one has less
//! predicted error (`core/src/method/choice.rs`).

use super::{Method, Plan, RenderSetup, bidirectional};
use crate::render::RenderError;
use crate::render::memory::Memory;
use crate::render::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::census::Census;
use halflight_core::findings::Finding;
use halflight_core::method::Method as _;
use halflight_core::method::bidirectional::BidirectionalSettings;
use halflight_core::method::caustics::CausticPathTracing;
use halflight_core::method::choice::{Best, LightPaths, Trial, TrialCaches};
use halflight_core::method::counts::Choice;

/// Outcome of a choice: the plan of another method, and the reason.
pub(super) struct Chosen<'a, F> {
    pub(super) instead: Option<Plan<'a, F>>,
    pub(super) finding: Finding,
}

/// The method that suits the picture, besides `paths`. `None` where time is too short for a trial.
pub(super) fn choose<'a, F: Features>(
    paths: &mut CausticPathTracing<F>,
    setup: &RenderSetup,
    memory: &mut Memory,
    executor: &mut Threads,
) -> Result<Option<Chosen<'a, F>>, RenderError> {
    let (context, settings) = (setup.context(), setup.settings);
    let goal = setup.goal();
    if !goal.affords_trial(context.pixels()) {
        return Ok(None);
    }
    let resolution = (!setup.has_open_cache()).then(|| settings.cache.resolution());
    let shards = settings.shard.count;
    let caches = TrialCaches { resolution, shards, lobes: settings.lobes };
    let Some(trial) = Trial::run(&context, paths, &caches, memory, executor)? else {
        return Ok(None);
    };
    // Photons of paths and caches have the light of merges, and no blur that lasts as long as the picture.
    let merging = settings.bidirectional.merging.or(Some(false));
    let techniques = BidirectionalSettings { merging, ..settings.bidirectional };
    let is_audited = settings.audit.is_none_or(|share| share > 0.0);
    let light_paths = match trial.affords_light_paths(&goal) {
        true => {
            let part = goal.part_of_pilot(context.pixels());
            bidirectional::choose::<F>(setup, memory, (&techniques, part, trial.has_photons))?
        }
        false => None,
    };
    let findings = paths.findings();
    // Merges are biased, as caches are.
    let light_paths = light_paths.filter(|choice| is_audited || !choice.counts.merging);
    let light_paths = light_paths.map(|choice| choice.beside(&findings));
    let found = light_paths.filter(|choice| choice.gain.is_some());
    let found =
        found.map(|Choice { noise, counts, .. }| LightPaths { noise, are_choice: counts.light_paths > 0.0 });
    let (best, finding) = trial.best(&goal, is_audited && may_have_cache(setup), found);
    let instead = match (best, light_paths) {
        (Best::Paths, _) | (Best::LightPaths, None) => None,
        (Best::Cache(picture), _) => Some(Plan::with_cache(Method::IrradianceCache, picture)),
        (Best::RadianceCache(picture), _) => Some(Plan::with_cache(Method::RadianceCache, picture)),
        (Best::LightPaths, Some(choice)) => {
            let method = if choice.counts.merging { Method::VertexMerging } else { Method::Bidirectional };
            Some(Plan::with_counts(method, choice))
        }
    };
    Ok(Some(Chosen { instead, finding }))
}

/// Whether a cache could supply light of the scene.
fn may_have_cache(setup: &RenderSetup) -> bool {
    let surfaces = Census::of(setup.scene).surfaces;
    setup.settings.max_depth.is_none_or(|depth| depth > 2) && surfaces.diffuse + surfaces.glossy > 0
}
