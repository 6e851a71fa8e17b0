//! The objects of `--json`, which scripts rely on (docs/cli.md). `run.json` is the same.

use super::{Maker, Race, Run};
use crate::compare::Comparison;
use crate::drive::{
    Against, Audited, Blurred, CausticUse, Deviation, Ending, ErrorEstimate, MapUse, Place, Region,
    RenderResult, Round, Shard,
};
use halflight_core::film::Dropped;
use serde_json::{Map, Value, json};

/// A render.
pub(super) fn run(run: &Run) -> Value {
    let CausticUse { used, share, lacks_memory } = run.result.caustics;
    let map = run.result.photons.and_then(|photons| photons.caustic).filter(|_| used).unwrap_or_default();
    let mut object = most(run);
    object["caustics"] = json!({
        "used": used,
        "share": share,
        "lacks_memory": lacks_memory,
        "paths": map.shot,
        "photons": map.stored,
    });
    object
}

fn most(run: &Run) -> Value {
    let (result, settings) = (run.result, run.settings);
    let left_out: Vec<Value> =
        run.left_out().iter().map(|(what, why)| json!({ "what": what, "why": why })).collect();
    let memory: Map<String, Value> =
        result.memory.iter().map(|part| (part.structure.into(), part.bytes.into())).collect();
    let shard = settings.shard;
    json!({
        "method": result.method.name(),
        "width": settings.width,
        "height": settings.height,
        "spp": result.spp,
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
        "history": result.history.iter().map(round).collect::<Vec<_>>(),
        "dropped": dropped_object(&result.counters.dropped, &result.places, result.empty_pixels),
        "filled_pixels": result.filled_pixels,
        "memory": memory,
        "memory_peak": result.memory_peak,
        "windows": {
            "used": result.windows.used,
            "gain": result.windows.gain.map(|gain| gain.factor()),
            "lacks_memory": result.windows.lacks_memory,
        },
        "reuse": {
            "used": result.reuse.used,
            "gain": result.reuse.pilot.map(|pilot| pilot.gain()),
            "cost": result.reuse.pilot.map(|pilot| pilot.cost()),
        },
        "cache": cache(run),
        "photons": result.photons.map(|photons| {
            let map = |map: MapUse| json!({
                "paths_wanted": map.wanted,
                "paths_given": map.given,
                "paths_shot": map.shot,
                "stored": map.stored,
                "seen": map.seen,
                "seen_by_power": map.by_power,
            });
            json!({
                "maps": photons.maps,
                "global": photons.global.map(map),
                "caustic": photons.caustic.map(map),
                "irradiances": photons.irradiances,
                "seconds": result.seconds.photons,
            })
        }),
        "left_out": left_out,
        "outputs": run.outputs,
        "checkpoint": settings.checkpoint.as_ref().map(|checkpoint| &checkpoint.path),
        "shard": (shard != Shard::WHOLE).then(|| [shard.index + 1, shard.count]),
        "made": made(run.maker),
    })
}

/// What became of the irradiance cache.
fn cache(run: &Run) -> Value {
    let (result, settings) = (run.result, run.settings);
    json!(result.cache.map(|cache| json!({
        "metric": settings.cache.metric.name(),
        "rays_per_record": cache.rays,
        "records": cache.records,
        "capacity": cache.capacity,
        "refused": cache.refused,
        "loaded": cache.loaded,
        "gathered": cache.gathered,
        "cut": cache.is_cut,
        "seconds": cache.seconds,
        "allowed": settings.cache.allowed(),
        "survey": result.survey.as_ref().map(|survey| json!({
            "points": survey.points,
            "reached": survey.checks.len() as f64 / survey.points.max(1) as f64,
            "predicted": survey.predicted,
            "achieved": survey.achieved,
            "rms": survey.rms,
            "noise": survey.noise,
            "seconds": survey.seconds,
        })),
    })))
}

/// A race.
pub(super) fn race(race: &Race) -> Value {
    let racers = race.racers.iter().enumerate().map(|(index, racer)| {
        let mut object = run(&racer.run);
        object["name"] = racer.name.clone().into();
        object["efficiency"] = race.efficiency(index).into();
        object["ratio"] = race.ratio(index).map(|ratio| ratio.value).into();
        object["ratio_interval"] = race.ratio(index).and_then(|ratio| ratio.interval).into();
        object
    });
    let name = |index: usize| race.racers[index].name.as_str();
    let leads = race.leads();
    let leads =
        leads.iter().map(|lead| json!({ "from": lead.from, "to": lead.to, "name": lead.who.map(name) }));
    json!({
        "time": race.seconds,
        "against": if race.has_reference() { "reference" } else { "estimate" },
        "methods": racers.collect::<Vec<_>>(),
        "leads": leads.collect::<Vec<_>>(),
        "made": made(race.maker),
    })
}

fn made(maker: &Maker) -> Value {
    json!({
        "command": maker.command,
        "version": maker.version,
        "machine": maker.machine,
        "processors": maker.processors,
        "date": maker.date,
    })
}

/// Against the reference where there is one, else as estimated; then `estimate` has the estimate too.
fn error(run: &Run) -> Value {
    let RenderResult { error: estimate, blurred, audit, .. } = run.result;
    let (blurred, audit) = (*blurred, audit.as_ref());
    let mut error = match run.comparison {
        None => error_object(*estimate, blurred, audit),
        Some(comparison) => {
            let mut error = comparison_object(comparison);
            error["interval"] = Value::Null;
            error["against"] = "reference".into();
            error["estimate"] = estimate_object(*estimate, "estimate");
            with_bias(error, blurred, audit)
        }
    };
    if audit.is_some() {
        error["bias"]["doubt"] = run.doubt().into();
    }
    error
}

/// The object of an estimate, with what photons blur, or an audit has found.
pub fn error_object(
    error: Option<ErrorEstimate>,
    blurred: Option<Blurred>,
    audit: Option<&Audited>,
) -> Value {
    with_bias(estimate_object(error, "estimate"), blurred, audit)
}

/// An error, with what photons blur, or an audit has found.
fn with_bias(mut object: Value, blurred: Option<Blurred>, audit: Option<&Audited>) -> Value {
    if let Some(Blurred { noise, blur, .. }) = blurred {
        object["noise"] = estimate_object(Some(noise), "estimate");
        object["blur"] = json!({ "relmse": blur.relmse, "interval": [blur.lower, blur.upper] });
    }
    if let Some(audit) = audit {
        object["noise"] = estimate_object(Some(audit.noise), "estimate");
        object["bias"] = bias(audit);
    }
    object
}

/// What an audit has found.
fn bias(audit: &Audited) -> Value {
    let deviation = |deviation: &Deviation| json!({ "mean": deviation.mean, "error": deviation.error });
    let region = |region: &Region| {
        let mut object = deviation(&region.deviation);
        for (name, value) in
            [("x", region.x), ("y", region.y), ("width", region.width), ("height", region.height)]
        {
            object[name] = value.into();
        }
        object["found"] = region.is_biased.into();
        object
    };
    json!({
        "found": audit.is_biased(),
        "relmse": audit.bias.relmse,
        "interval": [audit.bias.lower, audit.bias.upper],
        "detectable": audit.bias.detectable,
        "deviation": deviation(&audit.whole),
        "regions": audit.regions.iter().map(region).collect::<Vec<_>>(),
        "audit": {
            "share": audit.share,
            "pixels": audit.pixels,
            "samples": audit.samples,
            "rays": audit.rays,
            "seconds": audit.seconds,
            "photons": audit.has_photons,
            "unseen": audit.unseen,
            "blind": audit.is_blind,
        },
    })
}

/// The object of an estimate.
fn estimate_object(error: Option<ErrorEstimate>, against: &str) -> Value {
    match error {
        Some(ErrorEstimate { relmse, lower, upper }) => {
            json!({ "relmse": relmse, "interval": [lower, upper], "against": against })
        }
        None => json!({ "relmse": null, "interval": null, "against": against }),
    }
}

/// An entry of `history`.
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

/// The object of `compare --json`. Errors that are infinite are `null`: JSON has no infinity.
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

/// Places that are listed: those with the most.
const LISTED: usize = 64;

/// The object `dropped`.
pub fn dropped_object(dropped: &Dropped, places: &[Place], empty_pixels: u64) -> Value {
    let mut object = causes(dropped);
    object["empty_pixels"] = empty_pixels.into();
    object["tiles"] = places.len().into();
    let place = |place: &Place| {
        let mut object = causes(&place.dropped);
        object["x"] = place.x.into();
        object["y"] = place.y.into();
        object["width"] = place.width.into();
        object["height"] = place.height.into();
        object
    };
    object["places"] = places.iter().take(LISTED).map(place).collect();
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
