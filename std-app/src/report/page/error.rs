//! Error of a render in sentences, as a curve and by rounds.

use super::chart::{Chart, Series};
use super::parts;
use crate::render::{ErrorEstimate, RenderResult, Round};
use crate::report::Run;
use crate::report::fit::{Fit, Point};
use crate::report::quantity::{grouped, number, readable_seconds};
use maud::{Markup, html};

/// Ends of an interval.
pub(super) fn range(lower: f64, upper: f64) -> String {
    format!("{} to {}", number(lower, 3), number(upper, 3))
}

/// Ratio of the ends above which an interval is called uncertain.
const UNCERTAIN: f64 = 10.0;

/// First sentences of the page.
pub(super) fn lead(run: &Run) -> Markup {
    let interval = |error: ErrorEstimate| {
        html! {
            strong { (number(error.relmse, 3)) } " (95\u{202f}%: " (range(error.lower, error.upper)) ")"
        }
    };
    let source = match run.result {
        RenderResult { audit: Some(_), .. } => "noise and audit",
        RenderResult { noise_and_blur: Some(_), .. } => "noise and blur of photons",
        _ => "noise",
    };
    match (run.comparison, run.result.error) {
        (Some(comparison), estimate) => html! {
            "This picture has a relMSE of " strong { (number(comparison.linear.relmse, 3)) }
            " against the reference" (typical(comparison.linear.relmse)) ". The estimate from its " (source)
            " is "
            @if let Some(error) = estimate { (interval(error)) } @else { "unknown" } "."
        },
        (None, Some(error)) if error.upper > UNCERTAIN * error.lower => html! {
            "The relMSE of this picture is uncertain: the estimate is " strong { (number(error.relmse, 2)) }
            ", the 95\u{202f}% interval " (range(error.lower, error.upper))
            ". A few very bright samples dominate the error."
        },
        (None, Some(error)) => html! {
            "This picture has a relMSE of about " (interval(error)) ", estimated from its " (source)
            (typical(error.relmse)) "."
        },
        (None, None) => html! {
            "The error of this picture is unknown: the estimate needs four samples per pixel and some light."
        },
    }
}

/// Typical error of a pixel with this relMSE.
fn typical(relmse: f64) -> String {
    match relmse.is_finite() {
        true => format!(": a typical pixel is off by {}\u{202f}%", number(100.0 * relmse.sqrt(), 2)),
        false => String::new(),
    }
}

/// Styles of the curves.
const ESTIMATE: usize = 0;
const REFERENCE: usize = 1;

/// Curves of a render: estimate, and error against the reference.
pub(super) fn chart(run: &Run) -> Chart {
    let history = &run.result.history;
    let mut series = vec![estimated(history, "estimate", ESTIMATE)];
    if run.reference().is_some() {
        series.push(measured(history, "against the reference", REFERENCE));
    }
    series.retain(|series| !series.points.is_empty());
    let title = "relMSE against seconds of rendering, on logarithmic axes".into();
    Chart { title, series, leads: Vec::new() }
}

/// Curve of the estimates, with its interval and fit.
pub(super) fn estimated(history: &[Round], name: &str, style: usize) -> Series {
    let rounds = history.iter().filter_map(|round| Some((round.seconds, round.error?)));
    let rounds: Vec<_> = rounds.filter(|(_, error)| error.relmse > 0.0).collect();
    let points = rounds.iter().map(|(seconds, error)| [*seconds, error.relmse]).collect();
    let band = rounds.iter().map(|(seconds, error)| [*seconds, error.lower, error.upper]).collect();
    series(name, style, points, band)
}

/// Curve against the reference, with its fit.
pub(super) fn measured(history: &[Round], name: &str, style: usize) -> Series {
    let points = history.iter().filter_map(|round| Some([round.seconds, round.reference?.linear.relmse]));
    let is_positive = |[_, relmse]: &[f64; 2]| *relmse > 0.0 && relmse.is_finite();
    series(name, style, points.filter(is_positive).collect(), Vec::new())
}

fn series(name: &str, style: usize, points: Vec<[f64; 2]>, band: Vec<[f64; 3]>) -> Series {
    let fit = Fit::through(points.iter().map(|&[seconds, error]| Point { seconds, error }));
    Series { name: name.into(), style, points, band, fit }
}

/// Slopes of the curves and the time to the next power of ten.
pub(super) fn slopes(chart: &Chart) -> Markup {
    let fits: Vec<_> =
        chart.series.iter().filter_map(|series| Some((series, series.fit.as_ref()?))).collect();
    // The curve against the reference, the last one, is the better one.
    let Some((series, fit)) = fits.last() else {
        return html! { p { "A fit needs five rounds." } };
    };
    html! {
        p {
            "From " (time(fit.from)) " on, the error falls as a power of time: "
            @for (index, (series, fit)) in fits.iter().enumerate() {
                @if index > 0 { ", " }
                strong { (hundredths(fit.slope)) } " (95\u{202f}%: " (hundredths(fit.interval[0])) " to "
                (hundredths(fit.interval[1])) ") "
                (if series.style == ESTIMATE { "estimated" } else { &series.name })
            }
            ". Independent samples give −1." (prediction(series, fit))
        }
    }
}

fn hundredths(value: f64) -> String {
    format!("{value:.2}").replace('-', "−")
}

/// Seconds without a line break.
fn time(seconds: f64) -> String {
    readable_seconds(seconds).replace(' ', "\u{a0}")
}

/// Longest predicted time, as a multiple of the rendering time.
const MAX_PREDICTION: f64 = 1000.0;

/// Time to the next power of ten below the error.
fn prediction(series: &Series, fit: &Fit) -> String {
    let Some([now, error]) = series.points.last().copied() else { return String::new() };
    let goal = 10f64.powf((0.99 * error).log10().floor());
    let seconds = fit.seconds_to(goal);
    if fit.interval[1] >= 0.0 || !(now..now * MAX_PREDICTION).contains(&seconds) {
        return String::new();
    }
    format!(" At this rate a relMSE of {} takes {}.", number(goal, 1), time(seconds))
}

/// Rounds of the table, at most.
const MAX_ROWS: usize = 40;

/// Table of rounds, spread evenly over the logarithm of time.
pub(super) fn rounds(run: &Run) -> Markup {
    let history = &run.result.history;
    let mut rows: Vec<&Round> = Vec::new();
    for (index, round) in history.iter().enumerate() {
        let growth = (history[history.len() - 1].seconds / history[0].seconds).powf(1.0 / MAX_ROWS as f64);
        let is_later = rows.last().is_none_or(|last| round.seconds >= last.seconds * growth);
        if history.len() <= MAX_ROWS || is_later || index + 1 == history.len() {
            rows.push(round);
        }
    }
    let has_reference = run.reference().is_some();
    let mut head = vec!["time", "samples per pixel", "rays", "relMSE, estimated", "95 % interval"];
    head.extend(if has_reference { &["relMSE", "FLIP"][..] } else { &[] });
    let number_or_dash = |value: Option<f64>| value.map_or("–".into(), |value| number(value, 3));
    let cells = |round: &&Round| {
        let mut cells = vec![
            readable_seconds(round.seconds),
            grouped(round.spp.into()),
            grouped(round.rays),
            number_or_dash(round.error.map(|error| error.relmse)),
            round.error.map_or("–".into(), |error| range(error.lower, error.upper)),
        ];
        if has_reference {
            cells.push(number_or_dash(round.reference.map(|reference| reference.linear.relmse)));
            cells.push(number_or_dash(round.reference.map(|reference| reference.flip)));
        }
        cells
    };
    html! {
        (parts::table("Rounds", &head, &rows.iter().map(cells).collect::<Vec<_>>(), false))
        @if rows.len() < history.len() {
            p { (rows.len()) " of " (history.len()) " rounds; all rounds are in " code { "curve.csv" } "." }
        }
    }
}
