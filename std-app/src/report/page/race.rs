//! The page of a race.

use super::chart::Chart;
use super::error::{between, estimated, measured};
use super::picture::{exposable, reduced};
use super::run::{layout, smaller};
use super::{escape, fill, parts, shell};
use crate::report::race::Lead;
use crate::report::words::{grouped, number, plural, readable_seconds};
use crate::report::{Race, Racer};

/// The whole page.
pub(in crate::report) fn page(race: &Race) -> String {
    let Some(first) = race.racers.first().map(|racer| &racer.run) else { return String::new() };
    let chart = chart(race);
    let title = format!("{}: a race of {}", first.name, plural(race.racers.len() as u64, "method"));
    let body = fill(
        include_str!("race.html"),
        &[
            ("name", &escape(&title)),
            ("layout", layout(&first.result.image)),
            ("lead", &lead(race)),
            ("truth", truth(race)),
            ("chart", &chart.figure()),
            ("leads", &leads(race)),
            ("table", &table(race)),
            ("options", &options(race)),
            ("pictures", &pictures(race)),
            ("census", &parts::census(first)),
            ("left_out", &parts::left_out(first)),
            ("repairs", &parts::repairs(first)),
            ("ledgers", &ledgers(race)),
            ("made", &parts::made(race.maker, first)),
        ],
    );
    shell(&format!("{title} – halflight"), &body)
}

/// Who won, in a sentence.
fn lead(race: &Race) -> String {
    let time = readable_seconds(race.seconds);
    let best = (0..race.racers.len())
        .filter_map(|index| Some((index, race.efficiency(index)?)))
        .max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((best, _)) = best else {
        return format!("{} of rendering each; no picture has an error that is known.", escape(&time));
    };
    let name = |index: usize| escape(&race.racers[index].name);
    let open = race.leads().last().is_none_or(|lead| lead.who.is_none());
    let verdict = if race.racers.len() == 1 {
        format!("<strong>{}</strong> had nobody to race against", name(best))
    } else if open {
        "The intervals of the best overlap: <strong>too close to tell</strong>".into()
    } else {
        format!("<strong>{}</strong> has the highest efficiency", name(best))
    };
    let ratio = race.ratio(best).filter(|_| best > 0 && !open);
    let ratio = ratio.map(|ratio| format!(", {} times that of {}", number(ratio.value, 3), name(0)));
    format!("{verdict}{}, after {time} of rendering each.", ratio.unwrap_or_default())
}

fn truth(race: &Race) -> &'static str {
    if race.has_reference() {
        "Errors are measured against the reference."
    } else {
        "There is no reference: errors are estimated, each with the interval that holds it with 95 % confidence. \
         An estimate knows the noise that was seen and what photons blur, but no other bias of a biased method."
    }
}

fn chart(race: &Race) -> Chart {
    let curve = if race.has_reference() { measured } else { estimated };
    let series = race.racers.iter().enumerate().map(|(index, racer)| {
        let mut series = curve(&racer.run.result.history, &racer.name, index);
        series.fit = None;
        series
    });
    Chart {
        title: "The error of each method, relMSE, against seconds of rendering, on logarithmic axes".into(),
        series: series.collect(),
        leads: race.leads(),
    }
}

/// Who is ahead when, in words.
fn leads(race: &Race) -> String {
    let line = |lead: &Lead| {
        let who = lead.who.map_or("too close to tell".into(), |who| escape(&race.racers[who].name));
        format!("<li>{} to {}: {who}</li>", readable_seconds(lead.from), readable_seconds(lead.to))
    };
    let lines: String = race.leads().iter().map(line).collect();
    if lines.is_empty() { String::new() } else { format!("<h3>Ahead</h3><ol class=\"leads\">{lines}</ol>") }
}

/// The methods with their results.
fn table(race: &Race) -> String {
    let dash = || "–".to_string();
    let intervals = !race.has_reference();
    let mut head = vec!["method", "samples per pixel", "time", "relMSE"];
    head.extend(intervals.then_some("95 % interval"));
    head.extend(["efficiency", "over the first"]);
    head.extend(intervals.then_some("95 % interval"));
    let head: String = head.iter().map(|name| format!("<th scope=\"col\">{name}</th>")).collect();
    let row = |(index, racer): (usize, &Racer)| {
        let result = racer.run.result;
        let ratio = race.ratio(index);
        let interval = ratio.and_then(|ratio| ratio.interval);
        let mut cells = vec![
            grouped(result.spp.into()),
            readable_seconds(result.seconds.render),
            race.error(index).map_or_else(dash, |error| number(error, 3)),
        ];
        cells.extend(intervals.then(|| result.error.map_or_else(dash, |e| between(e.lower, e.upper))));
        cells.push(race.efficiency(index).map_or_else(dash, |efficiency| number(efficiency, 3)));
        cells.push(ratio.map_or_else(dash, |ratio| number(ratio.value, 3)));
        cells.extend(intervals.then(|| interval.map_or_else(dash, |[lower, upper]| between(lower, upper))));
        let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
        format!("<tr><th scope=\"row\">{}</th>{cells}</tr>", escape(&racer.name))
    };
    let rows: String = race.racers.iter().enumerate().map(row).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Results\"><table class=\"numbers\">\
         <thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )
}

/// The methods as choices of the two sides.
fn options(race: &Race) -> String {
    let option = |racer: &Racer| format!("<option>{}</option>", escape(&racer.name));
    race.racers.iter().map(option).collect()
}

/// The pictures side by side.
fn pictures(race: &Race) -> String {
    let figure = |racer: &Racer| {
        let (picture, factor) = reduced(&racer.run.result.image);
        let method = racer.run.result.method.name();
        format!(
            "<figure>{}<figcaption><h3>{}</h3><p>{} samples per pixel by {method}</p>{}</figcaption></figure>",
            exposable(&picture, &format!("The picture by {}", racer.name)),
            escape(&racer.name),
            grouped(racer.run.result.spp.into()),
            smaller(factor)
        )
    };
    race.racers.iter().map(figure).collect()
}

/// Dropped samples of each.
fn ledgers(race: &Race) -> String {
    let one = |racer: &Racer| format!("<h3>{}</h3>{}", escape(&racer.name), parts::ledger(&racer.run));
    race.racers.iter().map(one).collect()
}
