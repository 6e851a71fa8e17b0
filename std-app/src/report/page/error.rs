//! The error of a render in words, as a curve and round by round.

use super::chart::{Chart, Series};
use crate::drive::{ErrorEstimate, RenderResult, Round};
use crate::report::Run;
use crate::report::fit::{Fit, Point};
use crate::report::words::{grouped, number, readable_seconds};

/// `a × 10⁻³`, in 2 digits.
fn short(value: f64) -> String {
    number(value, 2)
}

/// Two ends of an interval.
pub(super) fn between(lower: f64, upper: f64) -> String {
    format!("{} to {}", number(lower, 3), number(upper, 3))
}

/// An interval is vague whose ends differ by more than this factor.
const VAGUE: f64 = 10.0;

/// The first sentences of the page, as HTML.
pub(super) fn lead(run: &Run) -> String {
    let interval = |error: ErrorEstimate| {
        format!(
            "<strong>{}</strong> (95&#8239;%: {})",
            number(error.relmse, 3),
            between(error.lower, error.upper)
        )
    };
    match (run.comparison, run.result.error) {
        (Some(comparison), estimate) => {
            let relmse = comparison.linear.relmse;
            let estimate = estimate.map_or("unknown".into(), interval);
            format!(
                "Against the reference this picture has a relMSE of <strong>{}</strong>{}. \
                 Estimated from its own noise{} it would be {estimate}.",
                number(relmse, 3),
                typical(relmse),
                match run.result {
                    RenderResult { audit: Some(_), .. } => " and an audit of its bias",
                    RenderResult { blurred: Some(_), .. } => " and what its photons blur",
                    _ => "",
                },
            )
        }
        (None, Some(error)) if error.upper > VAGUE * error.lower => format!(
            "The relMSE of this picture is not well known: with 95&#8239;% confidence it lies in {}, and is \
             estimated at <strong>{}</strong>. A few samples that are far brighter than the others decide.",
            between(error.lower, error.upper),
            number(error.relmse, 2)
        ),
        (None, Some(error)) => format!(
            "This picture has a relMSE of about {}, as its own noise {}{}.",
            interval(error),
            match run.result {
                RenderResult { audit: Some(_), .. } => "and an audit of its bias tell",
                RenderResult { blurred: Some(_), .. } => "and what its photons blur tell",
                _ => "tells",
            },
            typical(error.relmse),
        ),
        (None, None) => {
            "The error of this picture is not known: it takes four samples of each pixel, and some light."
                .into()
        }
    }
}

/// What a relMSE means for a pixel.
fn typical(relmse: f64) -> String {
    if !relmse.is_finite() {
        return String::new();
    }
    format!(": a pixel is off by about {}&#8239;% of its brightness", short(100.0 * relmse.sqrt()))
}

/// Styles of the curves.
const ESTIMATE: usize = 0;
const REFERENCE: usize = 1;

/// The curves of a render: as estimated, and against the reference.
pub(super) fn chart(run: &Run) -> Chart {
    let history = &run.result.history;
    let mut series = vec![estimated(history, "estimate", ESTIMATE)];
    if run.settings.reference.is_some() {
        series.push(measured(history, "against the reference", REFERENCE));
    }
    series.retain(|series| !series.points.is_empty());
    Chart {
        title: "The error, relMSE, against seconds of rendering, on logarithmic axes".into(),
        series,
        leads: Vec::new(),
    }
}

/// The curve of the estimates, with its band and line.
pub(super) fn estimated(history: &[Round], name: &str, style: usize) -> Series {
    let known = || history.iter().filter_map(|round| Some((round.seconds, round.error?)));
    let known = || known().filter(|(_, error)| error.relmse > 0.0);
    let point = |(seconds, error): (f64, ErrorEstimate)| Point { seconds, error: error.relmse };
    Series {
        name: name.into(),
        style,
        points: known().map(|(seconds, error)| [seconds, error.relmse]).collect(),
        band: known().map(|(seconds, error)| [seconds, error.lower, error.upper]).collect(),
        fit: Fit::through(known().map(point)),
    }
}

/// The curve against the reference, with its line.
pub(super) fn measured(history: &[Round], name: &str, style: usize) -> Series {
    let known = || history.iter().filter_map(|round| Some((round, round.reference?.linear.relmse)));
    let known = || known().filter(|(_, relmse)| *relmse > 0.0 && relmse.is_finite());
    let point = |(round, error): (&Round, f64)| Point { seconds: round.seconds, error };
    Series {
        name: name.into(),
        style,
        points: known().map(|(round, relmse)| [round.seconds, relmse]).collect(),
        band: Vec::new(),
        fit: Fit::through(known().map(point)),
    }
}

/// What the slope of the curves is, and what it promises.
pub(super) fn slopes(chart: &Chart) -> String {
    let fitted = || chart.series.iter().filter_map(|series| Some((series, series.fit.as_ref()?)));
    let slope = |(series, fit): (&Series, &Fit)| {
        let [lower, upper] = fit.interval.map(decimal);
        let which = if series.style == ESTIMATE { "as estimated" } else { "against the reference" };
        format!("<strong>{}</strong> (95&#8239;%: {lower} to {upper}) {which}", decimal(fit.slope))
    };
    let words: Vec<String> = fitted().map(slope).collect();
    // The last is the better one, where there are two.
    let Some((series, fit)) = fitted().next_back() else {
        return "<p>Too few rounds to fit a line: five are needed.</p>".into();
    };
    format!(
        "<p>From {} on, the error falls as time to the power {}; independent samples give −1.{}</p>",
        time(fit.from),
        words.join(" and "),
        promise(series, fit),
    )
}

/// In hundredths.
fn decimal(value: f64) -> String {
    format!("{value:.2}").replace('-', "−")
}

/// Seconds that stay on one line.
fn time(seconds: f64) -> String {
    readable_seconds(seconds).replace(' ', "\u{a0}")
}

/// Longest time that is foretold, as a multiple of the time that was rendered.
const FURTHEST: f64 = 1000.0;

/// The time for the next power of ten below.
fn promise(series: &Series, fit: &Fit) -> String {
    let Some([now, error]) = series.points.last().copied() else { return String::new() };
    let goal = 10f64.powf((0.99 * error).log10().floor());
    let seconds = fit.when(goal);
    if fit.interval[1] >= 0.0 || !(now..now * FURTHEST).contains(&seconds) {
        return String::new();
    }
    format!(" At this pace a relMSE of {} would take {}.", number(goal, 1), time(seconds))
}

/// Rounds of the table at most; the others are in `curve.csv`.
const ROWS: usize = 40;

/// The rounds as a table.
pub(super) fn rounds(run: &Run) -> String {
    let history = &run.result.history;
    let mut rows: Vec<&Round> = Vec::new();
    for (index, round) in history.iter().enumerate() {
        let growth = (history[history.len() - 1].seconds / history[0].seconds).powf(1.0 / ROWS as f64);
        let far = rows.last().is_none_or(|last| round.seconds >= last.seconds * growth);
        if history.len() <= ROWS || far || index + 1 == history.len() {
            rows.push(round);
        }
    }
    let reference = run.settings.reference.is_some();
    let mut head = vec!["time", "samples per pixel", "rays", "relMSE, estimated", "95 % interval"];
    if reference {
        head.extend(["relMSE", "FLIP"]);
    }
    let head: String = head.iter().map(|name| format!("<th scope=\"col\">{name}</th>")).collect();
    let dash = || "–".to_string();
    let body = rows.iter().map(|round| {
        let mut cells = vec![
            readable_seconds(round.seconds),
            grouped(round.spp.into()),
            grouped(round.rays),
            round.error.map_or_else(dash, |error| number(error.relmse, 3)),
            round.error.map_or_else(dash, |error| between(error.lower, error.upper)),
        ];
        if reference {
            let against = round.reference;
            cells.push(against.map_or_else(dash, |against| number(against.linear.relmse, 3)));
            cells.push(against.map_or_else(dash, |against| number(against.flip, 3)));
        }
        let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
        format!("<tr>{cells}</tr>")
    });
    let all = if rows.len() < history.len() {
        format!("<p>{} of {} rounds; all are in <code>curve.csv</code>.</p>", rows.len(), history.len())
    } else {
        String::new()
    };
    let body: String = body.collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Rounds\"><table class=\"numbers\">\
         <thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>{all}"
    )
}
