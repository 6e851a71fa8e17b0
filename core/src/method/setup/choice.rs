//! Choice of a method for a picture whose method is left open ([`crate::method::choice`]).

use super::memory::Unbuilt;
use super::{MethodKind, MethodPlan, MethodSetup};
use crate::bsdf::Features;
use crate::census::Census;
use crate::findings::Finding;
use crate::memory::{MemorySource, OutOfMemory};
use crate::method::bidirectional::BidirectionalSettings;
use crate::method::caustics::CausticPathTracing;
use crate::method::choice::{MethodPilot, NoiseGains, Trial, TrialCaches};
use crate::method::sppm::ProgressivePhotonMapping;
use crate::method::{Executor, RenderMethod, caustics, counts};
use crate::transport::PathSettings;

/// Greatest fraction of the picture's time for the pilot of progressive photon mapping.
const PILOT_TIME: f32 = 0.2;

/// Outcome of a choice: the plan of another method than path tracing, and the table with the reason.
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
    let gains = if setup.is_reconstructed { NoiseGains::OF_RECONSTRUCTION } else { NoiseGains::NONE };
    let trial = Trial { gains, ..trial };
    // Photons of paths and caches have the light of merges, and no blur that lasts as long as the picture.
    let merging = options.bidirectional.merging.or(Some(false));
    let techniques = BidirectionalSettings { merging, ..options.bidirectional };
    let light_paths = match trial.affords_light_paths(goal) {
        false => Err("its pilot takes too much of the work"),
        true => {
            let pilot = (&techniques, goal.part_of_pilot(context.pixels()), trial.has_photons);
            let choice = counts::choose::<F>(context, pilot, &mut memory.within(), executor)?;
            choice.ok_or("its counts are given, or there is no memory for a pilot")
        }
    };
    // Merges are biased, as caches are.
    let is_choice = |choice: &counts::Choice| setup.is_audited || !choice.counts.merging;
    let light_paths = light_paths.and_then(|choice| match is_choice(&choice) {
        true => Ok(choice.beside(&paths.findings())),
        false => Err("nothing would measure its bias"),
    });
    let photons = pilot_of_photons::<F>((&trial, light_paths), setup, memory, executor)?;
    let table = trial.table(goal, without_caches(setup), light_paths, photons);
    let best = *table.best();
    let instead = match (best.kind, light_paths) {
        (MethodKind::Path, _) => None,
        (kind @ (MethodKind::Bidirectional | MethodKind::VertexMerging), Ok(choice)) => {
            Some(MethodPlan::with_counts(kind, choice))
        }
        (kind, _) => Some(MethodPlan { picture: best.picture, ..kind.into() }),
    };
    Ok(Some(Chosen { instead, finding: table.finding() }))
}

/// A reason against caches.
fn without_caches(setup: &MethodSetup) -> Option<&'static str> {
    let surfaces = Census::of(setup.context.scene).surfaces;
    match setup.context.settings.max_depth > 2 && surfaces.diffuse + surfaces.glossy > 0 {
        _ if !setup.is_audited => Some("nothing would measure its bias"),
        true => None,
        false => Some("there is no indirect light of diffuse surfaces"),
    }
}

/// Pilot of progressive photon mapping, or the reason for none.
fn pilot_of_photons<'a: 'm, 'm, F: Features>(
    (trial, light_paths): (&Trial, Result<counts::Choice, &'static str>),
    setup: &MethodSetup<'a, '_>,
    memory: &mut impl MemorySource<'m>,
    executor: &mut impl Executor,
) -> Result<Result<MethodPilot, &'static str>, OutOfMemory> {
    let MethodSetup { context, options, ref goal, .. } = *setup;
    let PathSettings { width, height, .. } = context.settings;
    let unbuilt = Unbuilt { scene: context.scene, size: [width, height], options: &options };
    let reason = match trial.affords_photons(goal) {
        _ if !setup.is_audited => "nothing would measure its bias",
        _ if !caustics::are_possible(context.scene) => "nothing mirrors or refracts light narrowly",
        _ if !trial.may_need_photons(goal, light_paths) => "caustics are little of the noise",
        false => "its pilot takes too much of the work",
        true if !memory.has(unbuilt.photon_pilot::<F>()) => "there is no memory for its pilot",
        true => {
            let build = |context: &_, memory: &mut _, executor: &mut _| {
                ProgressivePhotonMapping::<F>::new(context, options.photons, 0, memory, executor)
            };
            let pilot = executor.within(PILOT_TIME, |executor| {
                MethodPilot::run(&context, &mut memory.within(), executor, build)
            });
            let noisy = pilot?.filter(|pilot| pilot.noise > 0.0);
            return Ok(noisy.ok_or("its pilot shows no noise, or had no time"));
        }
    };
    Ok(Err(reason))
}
