//! What the pages of renders and of races share: where time and memory went, what the scene holds and what was
//! left out, the ledger of dropped samples, and how the picture was made.

use super::escape;
use crate::report::words::{grouped, number, plural, readable_bytes, readable_seconds};
use crate::report::{Maker, Run, counts};
use core::fmt::Write;
use halflight_core::census::Census;

/// Rows of a name, an amount in words, and a bar of its share of the largest.
fn bars(caption: &str, rows: &[(String, String, f64)]) -> String {
    let most = rows.iter().map(|row| row.2).fold(f64::MIN_POSITIVE, f64::max);
    let row = |(name, amount, value): &(String, String, f64)| {
        let width = 100.0 * value / most;
        format!(
            "<tr><th scope=\"row\">{}</th><td>{amount}</td>\
             <td class=\"bar\" aria-hidden=\"true\"><i style=\"width:{width:.2}%\"></i></td></tr>",
            escape(name)
        )
    };
    let rows: String = rows.iter().map(row).collect();
    format!("<table class=\"bars\"><caption>{caption}</caption><tbody>{rows}</tbody></table>")
}

/// Seconds of each phase.
pub(super) fn time(run: &Run) -> String {
    let seconds = &run.result.seconds;
    let rest = run.total_seconds - run.load_seconds - seconds.build - seconds.render;
    let other = if run.comparison.is_some() { "comparing and saving" } else { "saving and the rest" };
    let rows = [
        ("loading", run.load_seconds),
        ("building", seconds.build),
        ("rendering", seconds.render),
        (other, rest.max(0.0)),
    ];
    bars("Time", &rows.map(|(name, seconds)| (name.into(), readable_seconds(seconds), seconds)))
}

/// Bytes of each structure.
pub(super) fn memory(run: &Run) -> String {
    let row = |name: &str, bytes: usize| (name.into(), readable_bytes(bytes), bytes as f64);
    let mut rows: Vec<_> = run.result.memory.iter().map(|part| row(part.structure, part.bytes)).collect();
    rows.push(row("at the peak", run.result.memory_peak));
    bars("Memory", &rows)
}

/// What the scene holds, as a table.
pub(super) fn census(run: &Run) -> String {
    let census = Census::of(run.scene);
    let mut rows = String::new();
    for (name, count) in counts(&census, run.scene).into_iter().filter(|(_, count)| *count > 0) {
        let name = name.replace('_', " ");
        // Writing to a string does not fail.
        let _ = write!(rows, "<tr><th scope=\"row\">{name}</th><td>{}</td></tr>", grouped(count));
    }
    format!("<table class=\"counts\"><caption>The scene holds</caption><tbody>{rows}</tbody></table>")
}

/// What was left out and why.
pub(super) fn left_out(run: &Run) -> String {
    let rows: String = run
        .left_out()
        .iter()
        .map(|(what, why)| {
            format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>", escape(what), escape(why))
        })
        .collect();
    if rows.is_empty() {
        return "<p>Nothing was left out: the scene needs all of it.</p>".into();
    }
    format!("<table class=\"counts\"><caption>Left out, and why</caption><tbody>{rows}</tbody></table>")
}

/// What the loader repaired.
pub(super) fn repairs(run: &Run) -> String {
    if run.repairs.is_empty() {
        return String::new();
    }
    let items: String = run.repairs.iter().map(|repair| format!("<li>{}</li>", escape(repair))).collect();
    format!("<h3>Repaired while loading</h3><ul class=\"plain\">{items}</ul>")
}

/// The samples that did not reach the picture: how many, why, where.
pub(super) fn ledger(run: &Run) -> String {
    let (dropped, paths) = (&run.result.counters.dropped, run.result.counters.paths);
    if dropped.total() == 0 {
        return format!("<p>Not one of {} samples had to be dropped.</p>", grouped(paths));
    }
    let outside = "left out of the picture";
    let cut = "cut at the technical limit of paths; what they saw up to there is in the picture";
    let rows = [
        ("not a number", outside, dropped.nan),
        ("infinite", outside, dropped.infinite),
        ("negative", outside, dropped.negative),
        ("unfinished", cut, dropped.unfinished),
    ];
    let rows = rows.map(|(cause, then, count)| {
        let share = number(100.0 * count as f64 / paths.max(1) as f64, 2);
        vec![cause.into(), grouped(count), format!("{share}&#8239;%"), then.into()]
    });
    let causes = table("Dropped samples", &["cause", "samples", "of all", "and then"], &rows);
    let black = match run.result.empty_pixels {
        0 => String::new(),
        count => format!(" {} are black for want of any sample.", grouped(count) + " pixels"),
    };
    format!(
        "<p>{} of {} samples did not reach the picture whole.{black}</p>{causes}{}",
        grouped(dropped.total()),
        grouped(paths),
        places(run)
    )
}

/// Tiles of the ledger that are listed.
const WORST: usize = 12;

/// Where samples were dropped, the worst first.
fn places(run: &Run) -> String {
    let all = &run.result.places;
    let rows: Vec<Vec<String>> = all
        .iter()
        .take(WORST)
        .map(|place| {
            let (right, bottom) = (place.x + place.width - 1, place.y + place.height - 1);
            let tile = format!("columns {} to {right}, rows {} to {bottom}", place.x, place.y);
            vec![tile, grouped(place.dropped.total())]
        })
        .collect();
    let most = if rows.len() < all.len() {
        format!(", the worst {WORST} of {}", grouped(all.len() as u64))
    } else {
        String::new()
    };
    format!(
        "<h3>Where{most}</h3>{}",
        table("Where samples were dropped", &["tile of the picture", "samples"], &rows)
    )
}

/// A table of numbers; the first cell of each row is its head, a fourth one text. Cells are HTML.
fn table(label: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    let class = |column: usize| if column == 3 { " class=\"text\"" } else { "" };
    let head = head.iter().enumerate().map(|(i, name)| format!("<th scope=\"col\"{}>{name}</th>", class(i)));
    let row = |cells: &Vec<String>| {
        let cells = cells.iter().enumerate().map(|(i, cell)| match i {
            0 => format!("<th scope=\"row\">{cell}</th>"),
            _ => format!("<td{}>{cell}</td>", class(i)),
        });
        format!("<tr>{}</tr>", cells.collect::<String>())
    };
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{label}\"><table class=\"numbers\">\
         <thead><tr>{}</tr></thead><tbody>{}</tbody></table></div>",
        head.collect::<String>(),
        rows.iter().map(row).collect::<String>()
    )
}

/// A share as it is read.
pub(super) fn percent(share: f64) -> String {
    format!("{}&#8239;%", number(100.0 * share, 2))
}

/// Name and value pairs of a `dl`. The values are HTML.
pub(super) fn facts(pairs: &[(&str, String)]) -> String {
    pairs.iter().map(|(name, value)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>")).collect()
}

/// Command, machine and settings.
pub(super) fn made(maker: &Maker, run: &Run) -> String {
    let (settings, result) = (run.settings, run.result);
    let plan = Census::of(run.scene).plan();
    let depth = settings.max_depth.map_or("no limit".into(), |depth| plural(depth.into(), "segment"));
    let pairs = [
        ("Method", format!("{}, compiled for: {}", result.method.name(), plan.features.name())),
        ("Size", format!("{} × {} pixels", settings.width, settings.height)),
        ("Longest path", depth),
        ("Seed", settings.seed.to_string()),
        ("Threads", format!("{} of {}", result.threads, maker.processors)),
        ("Instructions", settings.level.name().to_owned()),
        ("Machine", escape(&maker.machine)),
        ("Program", maker.version.to_owned()),
        ("Date", maker.date.clone()),
    ];
    format!(
        "<pre class=\"scroll\" tabindex=\"0\"><code>{}</code></pre><dl class=\"made\">{}</dl>",
        escape(&maker.shell()),
        facts(&pairs)
    )
}
