//! Summary of a render as text.

use super::compare as comparing;
use halflight::quantity::{plural, readable_bytes, readable_name, readable_seconds, readable_value};
use halflight::render::{Audited, BiasEstimate, Ending, ErrorEstimate, NoiseAndBlur, RejectedTile, StopRule};
use halflight::report::Run;
use halflight_core::findings::{Decision, Finding, Findings, Value};
use halflight_core::transport::Counters;
use std::path::Path;

/// Lines of `run`; `report` is the folder of its report. `by_default` is true if the user gave no stop rule.
pub(super) fn text(run: &Run, report: Option<&Path>, by_default: bool) -> String {
    let (result, settings) = (run.result, run.settings);
    let mut lines: Vec<_> = run.outputs.iter().map(|output| format!("saved  {}", output.display())).collect();
    lines.extend(report.map(|folder| format!("report {}", folder.join("index.html").display())));
    let early = if result.ending == Ending::Interrupted { ", stopped early" } else { "" };
    let (width, height, samples) = (settings.width, settings.height, plural(result.spp.into(), "sample"));
    let part = settings.shard.window.map_or(String::new(), |window| {
        let ([x, y], [across, down]) = (window.corner(), window.size());
        format!("{across}x{down} pixels at {x},{y} of ")
    });
    lines.push(format!("image  {part}{width}x{height}, {samples} per pixel{early}"));
    match &result.audit {
        None => lines.extend(estimate(
            result.error,
            result.noise_and_blur,
            (result.method.is_biased(), &result.findings),
        )),
        Some(audit) => {
            lines.extend(audited(audit));
            let doubt = run.doubt().filter(|_| audit.is_biased());
            lines.extend(doubt.map(|doubt| format!("       but {doubt}")));
        }
    }
    let error = readable_value(Value::Number(settings.stop.error.unwrap_or_default()));
    lines.extend(match (result.ending, result.stop_rule) {
        (Ending::Biased, _) => {
            Some(format!("       the bias alone exceeds relMSE {error}: more samples do not help"))
        }
        (Ending::NoiseFloor, _) => Some(format!(
            "       noise that all samples share exceeds relMSE {error}: more samples do not help; for an \
            irradiance cache more --cache-rays do"
        )),
        (_, Some(rule)) if by_default => {
            let end = if rule == StopRule::Error { "at relMSE 1e-3" } else { "after 60 s" };
            Some(format!("       ended {end}, the default; --spp, --time or --error set another end"))
        }
        _ => None,
    });
    if let Some(comparison) = run.comparison {
        lines.extend(comparing::text(comparison).lines().map(|line| format!("       {line}")));
    }
    lines.push(format!(
        "time   {} rendering, {} building, {} loading; {:.1} million rays/s on {} ({}, {})",
        readable_seconds(result.seconds.render),
        readable_seconds(result.seconds.build),
        readable_seconds(run.load_seconds),
        result.counters.all_rays() as f64 / result.seconds.render.max(1e-9) * 1e-6,
        plural(result.threads as u64, "thread"),
        result.method.name(),
        settings.level.name(),
    ));
    lines.extend(
        result
            .findings
            .iter()
            .zip(["method "].into_iter().chain(core::iter::repeat("       ")))
            .map(|(finding, label)| format!("{label}{}", self::finding(finding))),
    );
    lines.push(format!(
        "memory {}, {} at its peak",
        readable_bytes(result.memory.iter().map(|part| part.bytes).sum()),
        readable_bytes(result.memory_peak),
    ));
    lines.extend(rejected(&result.counters, &result.rejected_tiles, result.empty_pixels));
    if result.filled_pixels > 0 {
        let pixels = plural(result.filled_pixels, "pixel");
        lines.push(format!("       {pixels} without a sample show the mean of their neighbours"));
    }
    lines.join("\n")
}

/// Line of a finding: topic, decision, reason and values.
pub(super) fn finding(finding: &Finding) -> String {
    let values: Vec<_> = finding
        .values()
        .map(|(name, value)| format!("{} {}", readable_name(name), readable_value(value)))
        .collect();
    let parts = [finding.reason, &values.join(", ")].map(|part| match part {
        "" => String::new(),
        part => format!("; {part}"),
    });
    let line = format!("{}: {}{}", readable_name(finding.topic), finding.decision.name(), parts.concat());
    line.replace('\u{202f}', " ")
}

/// relMSE with its interval.
fn error(error: &ErrorEstimate) -> String {
    format!("error  relMSE {:.3e} (95 %: {:.3e} to {:.3e})", error.relmse, error.lower, error.upper)
}

/// Line of noise and another part of the error.
fn parts(noise: &ErrorEstimate, name: &str, part: &BiasEstimate) -> String {
    format!(
        "       noise {:.3e}; {name} {:.3e} (95 %: {:.3e} to {:.3e})",
        noise.relmse,
        part.relmse.max(0.0),
        part.lower,
        part.upper
    )
}

/// Lines of an error with an audit.
pub(super) fn audited(audit: &Audited) -> Vec<String> {
    let error = error(&audit.total);
    if audit.is_blind {
        let unseen = 100.0 * audit.work.unseen;
        return vec![
            format!("{error}, noise alone; the bias is unknown:"),
            format!("audit  its paths miss about {unseen:.0} % of the light, through mirrors and glass"),
        ];
    }
    let verdict = if audit.is_biased() { "bias found" } else { "no bias found" };
    vec![
        format!("{error}, noise and bias"),
        parts(&audit.noise, "bias", &audit.bias),
        format!(
            "audit  {verdict}: {} with {} each; whole picture off by {:+.2} % ± {:.2} %; \
             detectable bias {:.1e}",
            plural(audit.pixels.into(), "pixel"),
            plural(audit.work.samples.into(), "sample"),
            100.0 * audit.whole.mean,
            100.0 * audit.whole.error,
            audit.bias.detectable,
        ),
    ]
}

/// Lines of an error without an audit; `is_biased` if the method may have a bias.
pub(super) fn estimate(
    estimate: Option<ErrorEstimate>,
    noise_and_blur: Option<NoiseAndBlur>,
    (is_biased, findings): (bool, &Findings),
) -> Vec<String> {
    let Some(estimate) = estimate else {
        return vec!["error  unknown: the estimate needs four samples per pixel and some light".into()];
    };
    let error = error(&estimate);
    let bias = if is_biased { "; other bias is not included" } else { "" };
    match noise_and_blur {
        Some(NoiseAndBlur { noise, blur, .. }) => {
            vec![format!("{error}, noise and blur of photons{bias}"), parts(&noise, "blur", &blur)]
        }
        None if findings.get("reconstruction").is_some_and(|made| made.decision == Decision::Used) => {
            vec![format!("{error}, noise and bias of the reconstruction{bias}")]
        }
        None => vec![format!("{error}, noise alone{}", bias.replace("other bias", "bias"))],
    }
}

/// Lines on rejected samples with causes and the worst tile; none if there are none.
pub(super) fn rejected(counters: &Counters, tiles: &[RejectedTile], empty_pixels: u64) -> Vec<String> {
    let dropped = &counters.dropped;
    if dropped.total() == 0 {
        return Vec::new();
    }
    let mut lines = vec![format!(
        "dropped {} of {} samples: {} not a number, {} infinite, {} negative, {} unfinished",
        dropped.total(),
        counters.paths,
        dropped.nan,
        dropped.infinite,
        dropped.negative,
        dropped.unfinished
    )];
    lines.extend(tiles.first().map(|worst| {
        let (count, x, y) = (worst.dropped.total(), worst.x, worst.y);
        format!(
            "       in {}, most of them ({count}) in the tile at ({x}, {y})",
            plural(tiles.len() as u64, "tile")
        )
    }));
    if empty_pixels > 0 {
        lines.push(format!("       {} without any sample left: black", plural(empty_pixels, "pixel")));
    }
    lines
}
