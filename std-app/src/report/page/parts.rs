//! Sections and elements that the pages of renders and races share.

use crate::render::RejectedTile;
use crate::report::quantity::{
    grouped, percent, plural, readable_bytes, readable_name, readable_seconds, readable_value,
};
use crate::report::{Provenance, Run, counts};
use halflight_core::census::Census;
use maud::{Markup, html};

/// Definition of relMSE.
pub(super) fn relmse_definition() -> Markup {
    html! {
        "relMSE is the mean over pixels and channels of "
        span.formula { "(I − R)² / (R² + 0.01 m²)" }
        ", with the picture I, the truth R and the mean m of R. "
    }
}

/// Slider that changes the exposure of the pictures of a figure; `probe` shows the radiance at the pointer.
pub(super) fn exposure(probe: bool) -> Markup {
    html! {
        div.exposure hidden {
            label { "Exposure " input type="range" min="-8" max="8" step="0.25" value="0"; }
            output { "0" }
            button type="button" { "reset" }
            @if probe { span.probe aria-live="off" {} }
        }
    }
}

/// Two pictures, one over the other, with a slider at their boundary.
pub(super) fn split(left: &Markup, right: &Markup) -> Markup {
    html! {
        div.split {
            div.side { (left) }
            div class="side over" { (right) }
            input type="range" min="0" max="100" step="0.5" value="50" aria-label="Boundary of the \
            pictures" hidden;
        }
    }
}

/// Table of numbers. The first cell of a row is its header if `has_row_headers`.
pub(super) fn table(label: &str, head: &[&str], rows: &[Vec<String>], has_row_headers: bool) -> Markup {
    html! {
        div.scroll tabindex="0" role="region" aria-label=(label) {
            table.numbers {
                thead { tr { @for name in head { th scope="col" { (name) } } } }
                tbody {
                    @for row in rows {
                        tr {
                            @for (column, cell) in row.iter().enumerate() {
                                @if column == 0 && has_row_headers { th scope="row" { (cell) } }
                                @else { td { (cell) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Table of names and values under a caption.
fn pairs(caption: &str, rows: impl Iterator<Item = (String, String)>) -> Markup {
    html! {
        table.counts {
            caption { (caption) }
            tbody { @for (name, value) in rows { tr { th scope="row" { (name) } td { (value) } } } }
        }
    }
}

/// Names and values of a `dl`.
pub(super) fn facts(pairs: &[(impl AsRef<str>, String)]) -> Markup {
    html! { @for (name, value) in pairs { div { dt { (name.as_ref()) } dd { (value) } } } }
}

/// Table of names, amounts, and bars in proportion to the largest value.
fn bars(caption: &str, rows: &[(&str, String, f64)]) -> Markup {
    let most = rows.iter().map(|row| row.2).fold(f64::MIN_POSITIVE, f64::max);
    html! {
        table.bars {
            caption { (caption) }
            tbody {
                @for (name, amount, value) in rows {
                    tr {
                        th scope="row" { (name) }
                        td { (amount) }
                        @let width = format!("width:{:.2}%", 100.0 * value / most);
                        td.bar aria-hidden="true" { i style=(width) {} }
                    }
                }
            }
        }
    }
}

/// Section of time and memory.
pub(super) fn resources(run: &Run) -> Markup {
    let (result, seconds) = (run.result, &run.result.seconds);
    let rest = run.total_seconds - run.load_seconds - seconds.build - seconds.render;
    let time = [
        ("loading", run.load_seconds),
        ("building", seconds.build),
        ("rendering", seconds.render),
        ("comparing, saving and the rest", rest.max(0.0)),
    ];
    let time = time.map(|(name, seconds)| (name, readable_seconds(seconds), seconds));
    let bytes = result.memory.iter().map(|part| (part.structure, part.bytes));
    let bytes = bytes.chain([("at the peak", result.memory_peak)]);
    let memory: Vec<_> = bytes.map(|(name, bytes)| (name, readable_bytes(bytes), bytes as f64)).collect();
    html! {
        section {
            h2 { "Time and memory" }
            div.columns { (bars("Time", &time)) (bars("Memory", &memory)) }
        }
    }
}

/// Section of findings: decisions and numbers of the method.
pub(super) fn findings(run: &Run) -> Markup {
    let findings = &run.result.findings;
    html! {
        @if findings.iter().next().is_some() {
            section {
                h2 { "Decisions of the method" }
                @for finding in findings.iter() {
                    h3 { (readable_name(finding.topic)) ": " (finding.decision.name()) }
                    @if !finding.reason.is_empty() { p { (finding.reason) "." } }
                    dl class="facts row" {
                        @for (name, value) in finding.values() {
                            div { dt { (readable_name(name)) } dd { (readable_value(value)) } }
                        }
                    }
                }
            }
        }
    }
}

/// Section of the scene: contents, features that it does not need, repairs.
pub(super) fn scene(run: &Run) -> Markup {
    let census = Census::of(run.scene);
    let counts = counts(&census, run.scene).into_iter().filter(|(_, count)| *count > 0);
    let counts = counts.map(|(name, count)| (readable_name(name), grouped(count)));
    let left_out: Vec<_> = census.plan().left_out().map(|(what, why)| (what.into(), why.into())).collect();
    html! {
        section {
            h2 { "Scene" }
            div.columns {
                (pairs("Contents", counts))
                @if !left_out.is_empty() { (pairs("Not needed", left_out.into_iter())) }
            }
            @if !run.repairs.is_empty() {
                h3 { "Repaired while loading" }
                ul.plain { @for repair in run.repairs { li { (repair) } } }
            }
        }
    }
}

/// Tiles in the list of rejected samples.
const MAX_TILES: usize = 12;

/// Rejected samples: numbers, causes and tiles.
pub(super) fn dropped(run: &Run) -> Markup {
    let (dropped, paths) = (&run.result.counters.dropped, run.result.counters.paths);
    if dropped.total() == 0 {
        return html! { p { "None of " (grouped(paths)) " samples was dropped." } };
    }
    let causes = [
        ("not a number", dropped.nan),
        ("infinite", dropped.infinite),
        ("negative", dropped.negative),
        ("unfinished", dropped.unfinished),
    ];
    let fraction = |count: u64| percent(count as f64 / paths.max(1) as f64);
    let causes = causes.map(|(cause, count)| vec![cause.into(), grouped(count), fraction(count)]);
    let all = &run.result.rejected_tiles;
    let tile = |tile: &RejectedTile| {
        let (right, bottom) = (tile.x + tile.width - 1, tile.y + tile.height - 1);
        let name = format!("columns {} to {right}, rows {} to {bottom}", tile.x, tile.y);
        vec![name, grouped(tile.dropped.total())]
    };
    let tiles: Vec<_> = all.iter().take(MAX_TILES).map(tile).collect();
    html! {
        p {
            (grouped(dropped.total())) " of " (grouped(paths)) " samples were dropped. Unfinished paths were \
            cut at a technical limit, and the picture has their light up to there. Other dropped samples do \
            not count."
            @if run.result.empty_pixels > 0 {
                " " (plural(run.result.empty_pixels, "pixel")) " without any sample left: black."
            }
        }
        (table("Dropped samples", &["cause", "samples", "of all"], &causes, true))
        h3 {
            "Tiles with dropped samples"
            @if tiles.len() < all.len() { ", the worst " (MAX_TILES) " of " (grouped(all.len() as u64)) }
        }
        (table("Tiles with dropped samples", &["tile of the picture", "samples"], &tiles, true))
    }
}

/// Section of command, machine and settings.
pub(super) fn made(provenance: &Provenance, run: &Run) -> Markup {
    let (settings, result) = (run.settings, run.result);
    let plan = Census::of(run.scene).plan();
    let depth = settings.max_depth.map_or("no limit".into(), |depth| plural(depth.into(), "segment"));
    let pairs = [
        ("Method", format!("{}, compiled for: {}", result.method.name(), plan.features.name())),
        ("Size", format!("{} × {} pixels", settings.width, settings.height)),
        ("Longest path", depth),
        ("Seed", settings.seed.to_string()),
        ("Threads", format!("{} of {}", result.threads, provenance.processors)),
        ("Instruction set", settings.level.name().to_owned()),
        ("Machine", provenance.machine.clone()),
        ("Program", provenance.version.to_owned()),
        ("Date", provenance.date.clone()),
    ];
    html! {
        section {
            h2 { "Command and settings" }
            pre.scroll tabindex="0" { code { (provenance.shell()) } }
            dl.made { (facts(&pairs)) }
        }
    }
}
