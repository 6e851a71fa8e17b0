//! Summary of a render: lines for a person. The object of `--json` is that of the report.

use super::compare as comparing;
use super::ledger;
use halflight::drive::{Audited, BiasEstimate, Blurred, CacheUse, Ending, ErrorEstimate, MapUse, PhotonUse};
use halflight::report::Run;
use halflight::report::words::{plural, readable_bytes, readable_seconds};
use halflight_core::cache::irradiance::Metric;
use std::path::Path;

/// The lines of `run`; `report` is the folder of its report.
pub(super) fn text(run: &Run, report: Option<&Path>) -> String {
    let (result, settings) = (run.result, run.settings);
    let mut lines = Vec::new();
    for output in run.outputs {
        lines.push(format!("saved  {}", output.display()));
    }
    if let Some(folder) = report {
        lines.push(format!("report {}", folder.join("index.html").display()));
    }
    let early = if result.ending == Ending::Interrupted { ", stopped early" } else { "" };
    let (width, height, samples) = (settings.width, settings.height, plural(result.spp.into(), "sample"));
    lines.push(format!("image  {width}x{height}, {samples} per pixel{early}"));
    match &result.audit {
        None => lines.extend(estimate(result.error, result.blurred, result.method.is_biased())),
        Some(audit) => {
            lines.extend(audited(audit));
            let doubt = run.doubt().filter(|_| audit.is_biased());
            lines.extend(doubt.map(|doubt| format!("       but {doubt}")));
        }
    }
    match result.ending {
        Ending::Biased => lines.push(
            "       the bias alone is larger than the error asked for: more samples would not help".into(),
        ),
        Ending::NoiseFloor => lines.push(
            "       noise that all samples share stays above the error asked for: more samples would not help; for an \
             irradiance cache more rays per record (--cache-rays) would"
                .into(),
        ),
        Ending::Done | Ending::Interrupted => (),
    }
    if let Some(comparison) = run.comparison {
        lines.extend(comparing::text(comparison).lines().map(|line| format!("       {line}")));
    }
    let rays = result.counters.all_rays();
    lines.push(format!(
        "time   {} rendering, {} building, {} loading; {:.1} million rays/s on {} ({}, {})",
        readable_seconds(result.seconds.render),
        readable_seconds(result.seconds.build),
        readable_seconds(run.load_seconds),
        rays as f64 / result.seconds.render.max(1e-9) * 1e-6,
        plural(result.threads as u64, "thread"),
        result.method.name(),
        settings.level.name(),
    ));
    lines.extend(result.cache.as_ref().map(|cache| cached(cache, settings.cache.metric)));
    lines.extend(result.photons.iter().flat_map(|photons| photon_maps(photons, result.seconds.photons)));
    if result.windows.lacks_memory {
        lines.push(
            "light  not enough memory for environment visibility sampling: sky light may be noisier".into(),
        );
    }
    if result.caustics.lacks_memory {
        lines.push("light  not enough memory for caustic photons: caustics may be missing or noisy".into());
    }
    lines.push(format!(
        "memory {}, {} at its peak",
        readable_bytes(result.memory.iter().map(|part| part.bytes).sum()),
        readable_bytes(result.memory_peak),
    ));
    lines.extend(ledger::text(&result.counters, &result.places, result.empty_pixels));
    if result.filled_pixels > 0 {
        lines.push(format!(
            "       {} had no sample when the render ended, and show the mean of the pixels around them",
            plural(result.filled_pixels, "pixel")
        ));
    }
    lines.join("\n")
}

/// The line of an irradiance cache.
fn cached(cache: &CacheUse, metric: Metric) -> String {
    let lost = match cache.refused {
        0 => String::new(),
        refused => format!("; {refused} more did not fit into memory"),
    };
    let loaded = match cache.loaded {
        0 => String::new(),
        loaded => format!(", {loaded} of them loaded,"),
    };
    let cut = if cache.is_cut { "; cut short: points without a record are path traced" } else { "" };
    format!(
        "cache  {}{loaded} of {} rays in {} by {}{lost}{cut}",
        plural(cache.records, "record"),
        cache.rays,
        readable_seconds(cache.seconds),
        metric.name(),
    )
}

/// The lines of photon maps.
fn photon_maps(photons: &PhotonUse, seconds: f64) -> Vec<String> {
    let kinds = [(photons.global, "photon"), (photons.caustic, "caustic photon")];
    let stored: Vec<_> = kinds.iter().filter_map(|(map, name)| Some(map_text(map.as_ref()?, name))).collect();
    let mut lines = vec![format!(
        "light  {} in {}: {}",
        plural(photons.maps, "map"),
        readable_seconds(seconds),
        stored.join("; "),
    )];
    for (map, name) in [(photons.global, ""), (photons.caustic, " of caustics")] {
        if let Some(MapUse { seen: Some(seen), by_power: Some(by_power), .. }) = map {
            lines.push(format!(
                "       emission guiding: {:.2} % of light paths{name} reach visible surfaces ({:.2} % without)",
                100.0 * seen,
                100.0 * by_power
            ));
        }
    }
    for (map, name) in [(photons.global, "global"), (photons.caustic, "caustic")] {
        if let Some(map) = map.filter(|map| map.given < map.wanted) {
            lines.push(format!(
                "       not enough memory: {} of {} light paths for the {name} map, the picture is noisier",
                map.given, map.wanted
            ));
        }
    }
    lines
}

/// The lines of an audited estimate.
pub(super) fn audited(audit: &Audited) -> Vec<String> {
    let ErrorEstimate { relmse, lower, upper } = audit.total;
    if audit.is_blind {
        return vec![
            format!(
                "error  relMSE {relmse:.3e} (95 %: {lower:.3e} to {upper:.3e}), of noise; the bias is unknown:"
            ),
            format!(
                "audit  its paths cannot find about {:.0} % of the light, which arrives through mirrors and glass",
                100.0 * audit.unseen
            ),
        ];
    }
    let BiasEstimate { relmse: bias, lower: least, upper: most, detectable, .. } = audit.bias;
    let found = if audit.is_biased() { "bias found" } else { "no bias found" };
    vec![
        format!("error  relMSE {relmse:.3e} (95 %: {lower:.3e} to {upper:.3e}), noise and bias"),
        format!(
            "       {:.3e} of it is noise; bias {:.3e} (95 %: {least:.3e} to {most:.3e})",
            audit.noise.relmse,
            bias.max(0.0)
        ),
        format!(
            "audit  {found}: {} with {} each, off by {:+.2} % ± {:.2} % as a whole; a bias of {detectable:.1e} would be found",
            plural(audit.pixels.into(), "pixel"),
            plural(audit.samples.into(), "sample"),
            100.0 * audit.whole.mean,
            100.0 * audit.whole.error,
        ),
    ]
}

/// The lines of an estimate that nobody audited, of a method that may have a bias.
pub(super) fn estimate(
    error: Option<ErrorEstimate>,
    blurred: Option<Blurred>,
    is_biased: bool,
) -> Vec<String> {
    let Some(ErrorEstimate { relmse, lower, upper }) = error else {
        return vec!["error  unknown: the estimate needs four samples per pixel and some light".into()];
    };
    let bias = match (is_biased, blurred) {
        (true, Some(_)) => "; other bias is not in it",
        (true, None) => "; bias is not in it",
        (false, _) => "",
    };
    let from = if blurred.is_some() { "noise and what photons blur" } else { "estimated from its own noise" };
    let mut lines =
        vec![format!("error  relMSE {relmse:.3e} (95 %: {lower:.3e} to {upper:.3e}), {from}{bias}")];
    lines.extend(blurred.map(|Blurred { noise, blur, .. }| {
        let BiasEstimate { relmse: bias, lower, upper, .. } = blur;
        let bias = bias.max(0.0);
        format!(
            "       {:.3e} of it is noise; blur {bias:.3e} (95 %: {lower:.3e} to {upper:.3e})",
            noise.relmse
        )
    }));
    lines
}

/// What became of the maps of one kind.
fn map_text(map: &MapUse, name: &str) -> String {
    format!("{} of {}", plural(map.stored, name), plural(map.shot, "light path"))
}
