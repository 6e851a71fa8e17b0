//! Findings of a render, from the fields of its result. This file goes when methods emit findings.

use super::Run;
use crate::render::{
    CacheUse, CausticUse, ChainUse, MapUse, Method, PhotonUse, Reuse, Settings, Survey, VirtualLightUse,
    VisibilityUse,
};
use halflight_core::findings::Decision::{LeftOut, Limited, Used};
use halflight_core::findings::{Finding, Findings, Value};

/// Findings of `run`, in the order of the method's steps.
pub(super) fn of(run: &Run) -> Findings {
    let (result, settings) = (run.result, run.settings);
    let photons = result.photons.unwrap_or_default();
    let mut findings = Findings::default();
    findings.extend(environment_visibility(&result.environment_visibility));
    findings.extend(path_reuse(&result.reuse));
    findings.extend(result.cache.map(|cache| irradiance_cache(&cache, settings)));
    findings.extend(result.survey.as_ref().map(cache_survey));
    findings.extend(result.chains.map(|chains| markov_chains(&chains)));
    findings.extend(photon_maps(&photons, result.seconds.photons));
    findings.extend(photons.global.map(|map| map_finding("global_photons", &map)));
    findings.extend(result.virtual_lights.map(|used| virtual_lights(&used, result.reuse.used)));
    findings.extend(result.virtual_lights.and_then(|used| cut_light(&used)));
    findings.extend(caustic_photons(result.method, &result.caustics, &photons));
    findings
}

fn environment_visibility(visibility: &VisibilityUse) -> Option<Finding> {
    let finding = |decision, reason| Finding::new("environment_visibility", decision, reason);
    if visibility.lacks_memory {
        return Some(finding(LeftOut, "not enough memory: sky light may be noisier"));
    }
    let gain = Value::Number(visibility.gain?.factor().into());
    let finding = match visibility.used {
        true => finding(Used, "the environment is sampled by its visibility"),
        false => finding(LeftOut, "most of the environment is visible from everywhere"),
    };
    Some(finding.with("gain", gain))
}

fn path_reuse(reuse: &Reuse) -> Option<Finding> {
    let decision = if reuse.used { Used } else { LeftOut };
    let Some(pilot) = reuse.pilot else {
        return reuse.used.then_some(Finding::new("path_reuse", Used, "requested"));
    };
    let reason = if reuse.used { "it pays by a pilot" } else { "it costs more than it gains by a pilot" };
    let finding =
        Finding::new("path_reuse", decision, reason).with("gain", Value::Number(pilot.gain().into()));
    Some(finding.with("cost", Value::Number(pilot.cost().into())))
}

fn irradiance_cache(cache: &CacheUse, settings: &Settings) -> Finding {
    let (decision, reason) = match cache {
        CacheUse { is_cut: true, .. } => (Limited, "filling was cut short: other points are path traced"),
        CacheUse { refused: 1.., .. } => (Limited, "not enough memory: other points are path traced"),
        _ => (Used, "indirect light of diffuse surfaces is interpolated"),
    };
    Finding::new("irradiance_cache", decision, reason)
        .with("metric", Value::Name(settings.cache.metric.name()))
        .with("error", Value::Number(settings.cache.allowed().into()))
        .with("rays_per_record", Value::Count(cache.rays.into()))
        .with("records", Value::Count(cache.records))
        .with("capacity", Value::Count(cache.capacity))
        .with("gathered", Value::Count(cache.gathered))
        .with_count("loaded", cache.loaded)
        .with_count("refused", cache.refused)
        .with("seconds", Value::Seconds(cache.seconds))
}

fn markov_chains(chains: &ChainUse) -> Finding {
    let (decision, reason) = match chains.share {
        0.0 => (LeftOut, "path tracing finds all light well"),
        _ => (Used, "light that path tracing finds badly is found by Markov chains"),
    };
    let [small, large, subpath] = chains.accepted;
    Finding::new("markov_chains", decision, reason)
        .with("chains", Value::Count(chains.chains.into()))
        .with("mutations_per_chain", Value::Count(chains.mutations.into()))
        .with("independent_points", Value::Count(chains.candidates.into()))
        .with("accepted_small_steps", Value::Fraction(small))
        .with("accepted_large_steps", Value::Fraction(large))
        .with("accepted_subpath_steps", Value::Fraction(subpath))
        .with("share_of_light", Value::Fraction(chains.share))
        .with("share_error", Value::Fraction(chains.share_error))
}

fn cache_survey(survey: &Survey) -> Finding {
    let Survey { predicted, achieved, .. } = *survey;
    let reason = match predicted / achieved.max(f64::MIN_POSITIVE) {
        _ if survey.checks.is_empty() => "no record covers a test point",
        0.0 => "the metric predicts no error",
        ratio if ratio > 2.0 => "the error is less than half of the prediction",
        ratio if ratio < 0.5 => "the error is more than twice the prediction",
        _ => "the error is within a factor of two of the prediction",
    };
    Finding::new("cache_survey", Used, reason)
        .with("points", Value::Count(survey.points))
        .with("covered", Value::Fraction(survey.checks.len() as f64 / survey.points.max(1) as f64))
        .with("predicted", Value::Fraction(predicted))
        .with("achieved", Value::Fraction(achieved))
        .with("rms", Value::Fraction(survey.rms))
        .with("noise", Value::Fraction(survey.noise))
        .with("seconds", Value::Seconds(survey.seconds))
}

fn photon_maps(photons: &PhotonUse, seconds: f64) -> Option<Finding> {
    let finding = Finding::new("photon_maps", Used, "").with("maps", Value::Count(photons.maps));
    let finding = finding.with_count("irradiances", photons.irradiances);
    (photons.maps > 0).then_some(finding.with("seconds", Value::Seconds(seconds)))
}

fn virtual_lights(used: &VirtualLightUse, has_reuse: bool) -> Finding {
    let (decision, reason) = match has_reuse {
        _ if used.given < used.wanted => (Limited, "not enough memory: the picture is noisier"),
        _ if used.area == 0.0 => (LeftOut, "a pilot found none: paths find all light"),
        true => (Used, "they light the second vertex of paths, whose light neighbouring pixels share"),
        false => (Used, "they light the first rough vertex of paths"),
    };
    let limited = |paths: u32| (decision == Limited).then_some(Value::Count(paths.into()));
    Finding::new("virtual_lights", decision, reason)
        .with("light_paths", Value::Count(used.light_paths))
        .with("virtual_lights", Value::Count(used.lights))
        .with("connections", Value::Count(used.connections.into()))
        .with("lit_area", Value::Number(used.area.into()))
        .with_some("light_paths_given", limited(used.given))
        .with_some("light_paths_wanted", limited(used.wanted))
}

/// Light that the bound of the geometry term cuts, where it is left out.
fn cut_light(used: &VirtualLightUse) -> Option<Finding> {
    let share = Value::Fraction(used.cut?);
    let reason = "the bound of the geometry term cuts it, in corners most";
    Some(Finding::new("cut_light", LeftOut, reason).with("share_of_light", share))
}

fn caustic_photons(method: Method, caustics: &CausticUse, photons: &PhotonUse) -> Option<Finding> {
    let left_out = |reason| Some(Finding::new("caustic_photons", LeftOut, reason));
    let finding = match (photons.caustic, caustics.share) {
        _ if caustics.lacks_memory => left_out("not enough memory: caustics may be missing or noisy"),
        (Some(map), None) => Some(map_finding("caustic_photons", &map)),
        (map, Some(_)) if caustics.used => Some(map_finding("caustic_photons", &map.unwrap_or_default())),
        (_, Some(_)) => left_out("they carry too little light by a pilot"),
        (None, None) if method == Method::PhotonMap => left_out("no surface is specular enough"),
        (None, None) => None,
    };
    Some(finding?.with_some("share_of_light", caustics.share.map(Value::Fraction)))
}

fn map_finding(topic: &'static str, map: &MapUse) -> Finding {
    let (decision, reason) = match map.given < map.wanted {
        true => (Limited, "not enough memory: the picture is noisier"),
        false if map.by_power.is_some() => (Used, "emission is guided to the view"),
        false => (Used, ""),
    };
    let limited = (decision == Limited).then_some(());
    Finding::new(topic, decision, reason)
        .with("light_paths", Value::Count(map.shot))
        .with("photons", Value::Count(map.stored))
        .with_some("light_paths_per_map", limited.map(|()| Value::Count(map.given)))
        .with_some("light_paths_wanted", limited.map(|()| Value::Count(map.wanted)))
        .with_some("useful_light_paths", map.seen.map(Value::Fraction))
        .with_some("useful_without_guiding", map.by_power.map(Value::Fraction))
}
