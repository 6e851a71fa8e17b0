//! Page of a race.

use super::chart::Chart;
use super::error::{estimated, measured, range};
use super::picture::{exposable, reduced};
use super::run::{layout, reduction};
use super::{document, parts};
use crate::report::quantity::{grouped, number, plural, readable_seconds};
use crate::report::{Race, RaceEntry};
use maud::{Markup, html};

/// Whole page; empty for a race without methods.
pub(in crate::report) fn page(race: &Race) -> String {
    let Some(first) = race.entries.first().map(|entry| &entry.run) else { return String::new() };
    let heading = format!("{}: a race of {}", first.name, plural(race.entries.len() as u64, "method"));
    let main = html! {
        section {
            h2 { "Results" }
            p {
                @if race.has_reference() { "Errors are measured against the reference." }
                @else {
                    "Errors are estimated, with 95\u{202f}% intervals. The estimate covers sampled noise and \
                    the blur of photons, but no other bias."
                }
            }
            (table(race))
            p.note {
                "Efficiency is 1 / (relMSE · seconds of rendering): twice the efficiency takes half the time \
                for the same picture, if the error falls as 1 / time. Intervals cover the noise of the \
                pictures, but not the variation of times. "
                (parts::relmse_definition())
            }
        }
        section {
            h2 { "Error against run time" }
            (chart(race).figure())
            p.note { "The strip at the axis shows the leader; grey if the intervals of the best two \
            overlap." }
            (leads(race))
        }
        (pictures(race, layout(&first.result.image)))
        (parts::scene(first))
        section {
            h2 { "Dropped samples" }
            @for entry in &race.entries { h3 { (entry.name) } (parts::dropped(&entry.run)) }
        }
        (parts::made(race.provenance, first))
    };
    document(&heading, Some(lead(race)), &main)
}

/// Sentence about the best method.
fn lead(race: &Race) -> Markup {
    let time = readable_seconds(race.seconds);
    let best = (0..race.entries.len())
        .filter_map(|index| Some((index, race.efficiency(index)?)))
        .max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((best, _)) = best else {
        return html! { "The error of every picture is unknown, after " (time) " of rendering each." };
    };
    let is_open = race.leads().last().is_none_or(|lead| lead.leader.is_none());
    let ratio = race.ratio(best).filter(|_| best > 0 && !is_open);
    html! {
        @if race.entries.len() == 1 { strong { (race.entries[best].name) } " is the only method" }
        @else if is_open { "The intervals of the best methods overlap: " strong { "no clear winner" } }
        @else { strong { (race.entries[best].name) } " has the highest efficiency" }
        @if let Some(ratio) = ratio { ", " (number(ratio.value, 3)) " times that of " (race.entries[0].name) }
        ", after " (time) " of rendering each."
    }
}

fn chart(race: &Race) -> Chart {
    let curve = if race.has_reference() { measured } else { estimated };
    let series = race.entries.iter().enumerate().map(|(index, entry)| {
        let mut series = curve(&entry.run.result.history, &entry.name, index);
        series.fit = None;
        series
    });
    Chart {
        title: "relMSE of each method against seconds of rendering, on logarithmic axes".into(),
        series: series.collect(),
        leads: race.leads(),
    }
}

/// Leaders over time.
fn leads(race: &Race) -> Markup {
    let leads = race.leads();
    html! {
        @if !leads.is_empty() {
            h3 { "Leaders" }
            ol.leads {
                @for lead in &leads {
                    li {
                        (readable_seconds(lead.from)) " to " (readable_seconds(lead.to)) ": "
                        (lead.leader.map_or("no clear leader", |leader| &race.entries[leader].name))
                    }
                }
            }
        }
    }
}

/// Table of methods and results.
fn table(race: &Race) -> Markup {
    let has_intervals = !race.has_reference();
    let interval = has_intervals.then_some("95 % interval");
    let mut head = vec!["method", "samples per pixel", "time", "relMSE"];
    head.extend(interval);
    head.extend(["efficiency", "over the first"]);
    head.extend(interval);
    let number_or_dash = |value: Option<f64>| value.map_or("–".into(), |value| number(value, 3));
    let range_or_dash = |ends: Option<[f64; 2]>| ends.map_or("–".into(), |[low, high]| range(low, high));
    let row = |(index, entry): (usize, &RaceEntry)| {
        let (result, ratio) = (entry.run.result, race.ratio(index));
        let mut cells = vec![
            entry.name.clone(),
            grouped(result.spp.into()),
            readable_seconds(result.seconds.render),
            number_or_dash(race.error(index)),
        ];
        cells.extend(has_intervals.then(|| range_or_dash(result.error.map(|e| [e.lower, e.upper]))));
        cells.push(number_or_dash(race.efficiency(index)));
        cells.push(number_or_dash(ratio.map(|ratio| ratio.value)));
        cells.extend(has_intervals.then(|| range_or_dash(ratio.and_then(|ratio| ratio.interval))));
        cells
    };
    let rows: Vec<_> = race.entries.iter().enumerate().map(row).collect();
    parts::table("Results", &head, &rows, true)
}

/// Section of the pictures, two of them over each other.
fn pictures(race: &Race, layout: &str) -> Markup {
    let options = html! { @for entry in &race.entries { option { (entry.name) } } };
    let figure = |entry: &RaceEntry| {
        let result = entry.run.result;
        let (picture, factor) = reduced(&result.image);
        html! {
            figure {
                (exposable(&picture, &format!("Picture by {}", entry.name)))
                figcaption {
                    h3 { (entry.name) }
                    p { (grouped(result.spp.into())) " samples per pixel by " (result.method.name()) }
                    (reduction(factor))
                }
            }
        }
    };
    html! {
        section {
            h2 { "Pictures" }
            figure class={ "picture compared " (layout) } hidden {
                (parts::split(&html! {}, &html! {}))
                figcaption {
                    p.sides {
                        @for side in ["Left picture", "Right picture"] {
                            label { span.unseen { (side) } select { (options) } }
                        }
                    }
                    (parts::exposure(false))
                }
            }
            div.maps #pictures { @for entry in &race.entries { (figure(entry)) } }
        }
    }
}
