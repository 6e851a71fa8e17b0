//! What is said when a render is done: the object of `--json`, which scripts rely on (docs/cli.md), and the
//! lines for a person.

use super::compare as comparing;
use super::ledger;
use super::values::{readable_bytes, readable_seconds};
use halflight::compare::Comparison;
use halflight::drive::{Against, Ending, ErrorEstimate, RenderResult, Round, Settings, Shard};
use halflight_core::census::Census;
use halflight_core::scene::Scene;
use serde_json::{Map, Value, json};
use std::path::PathBuf;

/// A render that is done.
pub(super) struct Summary<'a> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) settings: &'a Settings,
    pub(super) result: &'a RenderResult,
    pub(super) comparison: Option<&'a Comparison>,
    pub(super) outputs: &'a [PathBuf],
    pub(super) load_seconds: f64,
    pub(super) total_seconds: f64,
}

impl Summary<'_> {
    pub(super) fn object(&self) -> Value {
        let (result, settings) = (self.result, self.settings);
        let plan = Census::of(self.scene).plan();
        let left_out: Vec<Value> =
            plan.left_out().map(|(what, why)| json!({ "what": what, "why": why })).collect();
        let memory: Map<String, Value> =
            result.memory.iter().map(|part| (part.structure.into(), part.bytes.into())).collect();
        let shard = settings.shard;
        json!({
            "method": plan.method,
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
            },
            "seconds": {
                "load": self.load_seconds,
                "build": result.seconds.build,
                "render": result.seconds.render,
                "total": self.total_seconds,
            },
            "rays": result.counters.rays + result.counters.shadow_rays,
            "shadow_rays": result.counters.shadow_rays,
            "paths": result.counters.paths,
            "mean_radiance": result.image.mean(),
            "error": self.error(),
            "history": self.result.history.iter().map(round).collect::<Vec<_>>(),
            "dropped": ledger::object(&result.counters.dropped, &result.places, result.empty_pixels),
            "memory": memory,
            "memory_peak": result.memory_peak,
            "left_out": left_out,
            "outputs": self.outputs,
            "checkpoint": settings.checkpoint.as_ref().map(|checkpoint| &checkpoint.path),
            "shard": (shard != Shard::WHOLE).then(|| [shard.index + 1, shard.count]),
        })
    }

    /// Against the reference where there is one, else as estimated; then `estimate` has the estimate too.
    fn error(&self) -> Value {
        let estimate = |against| estimate(self.result.error, against);
        let Some(comparison) = self.comparison else { return estimate("estimate") };
        let mut error = comparing::object(comparison);
        error["interval"] = Value::Null;
        error["against"] = "reference".into();
        error["estimate"] = estimate("estimate");
        error
    }

    pub(super) fn text(&self) -> String {
        let (result, settings) = (self.result, self.settings);
        let mut lines = Vec::new();
        for output in self.outputs {
            lines.push(format!("saved  {}", output.display()));
        }
        let early = if result.ending == Ending::Interrupted { ", stopped early" } else { "" };
        let (width, height, samples) =
            (settings.width, settings.height, plural(result.spp as usize, "sample"));
        lines.push(format!("image  {width}x{height}, {samples} per pixel{early}"));
        lines.push(estimate_text(result.error));
        if let Some(comparison) = self.comparison {
            lines.extend(comparing::text(comparison).lines().map(|line| format!("       {line}")));
        }
        let rays = result.counters.rays + result.counters.shadow_rays;
        lines.push(format!(
            "time   {} rendering, {} building, {} loading; {:.1} million rays/s on {} ({}, {})",
            readable_seconds(result.seconds.render),
            readable_seconds(result.seconds.build),
            readable_seconds(self.load_seconds),
            rays as f64 / result.seconds.render.max(1e-9) * 1e-6,
            plural(result.threads, "thread"),
            Census::of(self.scene).plan().method,
            settings.level.name(),
        ));
        lines.push(format!(
            "memory {}, {} at its peak",
            readable_bytes(result.memory.iter().map(|part| part.bytes).sum()),
            readable_bytes(result.memory_peak),
        ));
        lines.extend(ledger::text(&result.counters, &result.places, result.empty_pixels));
        lines.join("\n")
    }
}

/// The object of an estimate.
pub(super) fn estimate(error: Option<ErrorEstimate>, against: &str) -> Value {
    match error {
        Some(ErrorEstimate { relmse, lower, upper }) => {
            json!({ "relmse": relmse, "interval": [lower, upper], "against": against })
        }
        None => json!({ "relmse": null, "interval": null, "against": against }),
    }
}

/// The line of an estimate.
pub(super) fn estimate_text(error: Option<ErrorEstimate>) -> String {
    match error {
        Some(ErrorEstimate { relmse, lower, upper }) => {
            format!(
                "error  relMSE {relmse:.3e} (95 %: {lower:.3e} to {upper:.3e}), estimated from its own noise"
            )
        }
        None => "error  unknown: it takes four samples per pixel and some light".into(),
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

pub(super) fn plural(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}
