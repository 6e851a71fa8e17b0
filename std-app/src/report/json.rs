//! Objects of `--json` and `run.json`: a contract with scripts (docs/cli.md).

use super::fit::{Fit, Point};
use super::{Provenance, Race, Run, counts};
use crate::compare::Comparison;
use crate::render::{
    Against, Audited, Ending, ErrorEstimate, NoiseAndBlur, Region, RejectedTile, RenderResult, Round,
    StopRule,
};
use halflight_core::census::Census;
use halflight_core::film::Dropped;
use halflight_core::findings::{Decision, Findings, Value as FindingValue};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Object of a render.
pub(super) fn run(run: &Run) -> Value {
    let (result, settings) = (run.result, run.settings);
    let census = Census::of(run.scene);
    let plan = census.plan();
    let contents = counts(&census, run.scene).into_iter().map(|(name, count)| (name.into(), count.into()));
    let memory = result.memory.iter().map(|part| (part.structure.into(), part.bytes.into()));
    let shard = settings.shard;
    json!({
        "scene": run.name,
        "method": result.method.name(),
        "features": plan.features.name(),
        "max_depth": settings.max_depth,
        "width": settings.width,
        "height": settings.height,
        "spp": result.spp,
        "samples": [result.samples.iter().min(), result.samples.iter().max()],
        "rounds": result.rounds,
        "seed": settings.seed,
        "threads": result.threads,
        "level": settings.level.name(),
        "ending": match result.ending {
            Ending::Done => "done",
            Ending::Interrupted => "interrupted",
            Ending::Biased => "biased",
            Ending::NoiseFloor => "noise-floor",
        },
        "stop_rule": result.stop_rule.map(|rule| match rule {
            StopRule::Samples => "spp",
            StopRule::Time => "time",
            StopRule::Error => "error",
        }),
        "seconds": {
            "load": run.load_seconds,
            "build": result.seconds.build,
            "render": result.seconds.render,
            "estimate": result.seconds.estimate,
            "total": run.total_seconds,
        },
        "rays": result.counters.all_rays(),
        "shadow_rays": result.counters.shadow_rays,
        "paths": result.counters.paths,
        "mean_radiance": result.image.mean(),
        "error": error(run),
        "history": result.history.iter().map(round).collect::<Value>(),
        "fit": fits(&result.history),
        "dropped": dropped_object(&result.counters.dropped, &result.rejected_tiles, result.empty_pixels),
        "filled_pixels": result.filled_pixels,
        "memory": memory.collect::<Map<_, _>>(),
        "memory_peak": result.memory_peak,
        "findings": findings_object(&result.findings),
        "census": contents.collect::<Map<_, _>>(),
        "repairs": run.repairs,
        "left_out": left_out_array(plan.left_out().chain(techniques_left_out(&result.findings))),
        "outputs": run.outputs.iter().map(|file| file_name(file)).collect::<Value>(),
        "checkpoint": settings.checkpoint.as_ref().map(|checkpoint| file_name(&checkpoint.path)),
        "shard": (shard.count > 1).then(|| [shard.index + 1, shard.count]),
        "crop": shard.window.map(|window| [window.corner(), window.size()].concat()),
        "made": made(run.provenance),
    })
}

/// Name of a file in an object: JSON has no bytes beyond Unicode.
pub fn file_name(file: &Path) -> Value {
    file.to_string_lossy().into()
}

/// Findings by topic: decision, reason and values.
pub fn findings_object(findings: &Findings) -> Value {
    let value = |value| match value {
        FindingValue::Count(count) => count.into(),
        FindingValue::Seconds(value) | FindingValue::Fraction(value) | FindingValue::Number(value) => {
            Value::from(value)
        }
        FindingValue::Name(name) => name.into(),
        FindingValue::Prediction { error, work, reason } => {
            json!({ "error": error, "rays_per_sample": work, "reason": reason })
        }
    };
    let object = |finding: &halflight_core::findings::Finding| {
        let mut object = json!({ "decision": finding.decision.name(), "reason": finding.reason });
        finding.values().for_each(|(name, number)| object[name] = value(number));
        (finding.topic.into(), object)
    };
    findings.iter().map(object).collect::<Map<_, _>>().into()
}

/// Techniques that a pilot of counts has left out, with reasons.
fn techniques_left_out(findings: &Findings) -> impl Iterator<Item = (&'static str, &'static str)> {
    let is_technique = |topic| ["light_paths", "connections", "merging"].contains(&topic);
    let left_out = findings.iter().filter(|finding| finding.decision == Decision::LeftOut);
    left_out.filter(move |finding| is_technique(finding.topic)).map(|finding| (finding.topic, finding.reason))
}

/// Array `left_out`: features and techniques that a picture does not need, with reasons.
pub fn left_out_array<'a>(features: impl Iterator<Item = (&'a str, &'a str)>) -> Value {
    features.map(|(what, why)| json!({ "what": what, "why": why })).collect()
}

/// Object of a race.
pub(super) fn race(race: &Race) -> Value {
    let entries = race.entries.iter().enumerate().map(|(index, entry)| {
        let mut object = run(&entry.run);
        object["name"] = entry.name.clone().into();
        object["efficiency"] = race.efficiency(index).into();
        object["ratio"] = race.ratio(index).map(|ratio| ratio.value).into();
        object["ratio_interval"] = race.ratio(index).and_then(|ratio| ratio.interval).into();
        object
    });
    let name = |index: usize| race.entries[index].name.as_str();
    let leads = race.leads().into_iter();
    let leads = leads.map(|lead| json!({ "from": lead.from, "to": lead.to, "name": lead.leader.map(name) }));
    json!({
        "time": race.seconds,
        "against": if race.has_reference() { "reference" } else { "estimate" },
        "methods": entries.collect::<Value>(),
        "leads": leads.collect::<Value>(),
        "made": made(race.provenance),
    })
}

fn made(provenance: &Provenance) -> Value {
    json!({
        "command": provenance.command,
        "version": provenance.version,
        "machine": provenance.machine,
        "processors": provenance.processors,
        "date": provenance.date,
    })
}

/// Error against the reference, with the estimate in `estimate`; without a reference the estimate.
fn error(run: &Run) -> Value {
    let RenderResult { error: estimate, noise_and_blur, audit, .. } = run.result;
    let (noise_and_blur, audit) = (*noise_and_blur, audit.as_ref());
    let mut error = match run.comparison {
        None => error_object(*estimate, noise_and_blur, audit),
        Some(comparison) => {
            let mut error = comparison_object(comparison);
            error["interval"] = Value::Null;
            error["against"] = "reference".into();
            error["estimate"] = estimate_object(*estimate);
            with_bias(error, noise_and_blur, audit)
        }
    };
    if audit.is_some() {
        error["bias"]["doubt"] = run.doubt().into();
    }
    error
}

/// Object of an estimate, with the blur of photons or the result of an audit.
pub fn error_object(
    error: Option<ErrorEstimate>,
    noise_and_blur: Option<NoiseAndBlur>,
    audit: Option<&Audited>,
) -> Value {
    with_bias(estimate_object(error), noise_and_blur, audit)
}

fn with_bias(mut object: Value, noise_and_blur: Option<NoiseAndBlur>, audit: Option<&Audited>) -> Value {
    if let Some(NoiseAndBlur { noise, blur, .. }) = noise_and_blur {
        object["noise"] = estimate_object(Some(noise));
        object["blur"] = json!({ "relmse": blur.relmse, "interval": [blur.lower, blur.upper] });
    }
    if let Some(audit) = audit {
        object["noise"] = estimate_object(Some(audit.noise));
        object["bias"] = bias(audit);
    }
    object
}

fn bias(audit: &Audited) -> Value {
    let region = |region: &Region| {
        json!({
            "x": region.x,
            "y": region.y,
            "width": region.width,
            "height": region.height,
            "mean": region.deviation.mean,
            "error": region.deviation.error,
            "found": region.is_biased,
        })
    };
    json!({
        "found": audit.is_biased(),
        "relmse": audit.bias.relmse,
        "interval": [audit.bias.lower, audit.bias.upper],
        "detectable": audit.bias.detectable,
        "deviation": {
            "mean": audit.whole.mean,
            "error": audit.whole.error,
            "found": audit.whole_is_biased(),
        },
        "regions": audit.regions.iter().map(region).collect::<Value>(),
        "audit": {
            "share": audit.work.fraction,
            "pixels": audit.pixels,
            "samples": audit.work.samples,
            "rays": audit.work.rays,
            "seconds": audit.work.seconds,
            "photons": audit.work.has_photons,
            "unseen": audit.work.unseen,
            "blind": audit.is_blind,
        },
    })
}

fn estimate_object(error: Option<ErrorEstimate>) -> Value {
    json!({
        "relmse": error.map(|error| error.relmse),
        "interval": error.map(|error| [error.lower, error.upper]),
        "against": "estimate",
    })
}

/// Entry of `history`.
fn round(round: &Round) -> Value {
    let mut object = json!({
        "seconds": round.seconds,
        "spp": round.spp,
        "rays": round.rays,
        "relmse": round.error.map(|error| error.relmse),
        "interval": round.error.map(|error| [error.lower, error.upper]),
    });
    if let Some(Against { linear, flip }) = round.reference {
        object["reference"] =
            json!({ "relmse": linear.relmse, "mse": linear.mse, "rmse": linear.rmse(), "flip": flip });
    }
    object
}

/// Power laws of the error against time: of the estimates, and against the reference.
fn fits(history: &[Round]) -> Value {
    let fit = |error: fn(&Round) -> Option<f64>| {
        let points =
            history.iter().filter_map(|round| Some(Point { seconds: round.seconds, error: error(round)? }));
        let Fit { level, slope, interval, from } = Fit::through(points)?;
        Some(json!({ "slope": slope, "interval": interval, "level": level, "from": from }))
    };
    json!({
        "estimate": fit(|round| Some(round.error?.relmse)),
        "reference": fit(|round| Some(round.reference?.linear.relmse)),
    })
}

/// Object of `compare --json`. Errors that are infinite or NaN are `null`, which JSON lacks.
pub fn comparison_object(comparison: &Comparison) -> Value {
    let linear = &comparison.linear;
    json!({
        "width": comparison.width,
        "height": comparison.height,
        "relmse": linear.relmse,
        "mse": linear.mse,
        "rmse": linear.rmse(),
        "flip": comparison.flip,
        "mean": linear.mean,
        "reference_mean": linear.reference_mean,
        "non_finite": linear.non_finite,
        "reference_non_finite": linear.reference_non_finite,
    })
}

/// Tiles listed in `dropped`, worst first.
const MAX_TILES: usize = 64;

/// Object `dropped`: rejected samples by cause, and the worst tiles.
pub fn dropped_object(dropped: &Dropped, tiles: &[RejectedTile], empty_pixels: u64) -> Value {
    let tile = |tile: &RejectedTile| {
        let mut object = causes(&tile.dropped);
        for (name, value) in [("x", tile.x), ("y", tile.y), ("width", tile.width), ("height", tile.height)] {
            object[name] = value.into();
        }
        object
    };
    let mut object = causes(dropped);
    object["empty_pixels"] = empty_pixels.into();
    object["tiles"] = tiles.len().into();
    object["places"] = tiles.iter().take(MAX_TILES).map(tile).collect();
    object
}

fn causes(dropped: &Dropped) -> Value {
    json!({
        "nan": dropped.nan,
        "infinite": dropped.infinite,
        "negative": dropped.negative,
        "unfinished": dropped.unfinished,
    })
}
