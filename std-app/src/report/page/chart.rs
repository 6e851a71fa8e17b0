//! Curves of error against time as SVG, on logarithmic axes. Colours come from the style sheet, so charts
//! follow the dark mode. A chart has three widths, of which the style sheet shows one.

use crate::report::fit::Fit;
use crate::report::quantity::{number, power_of_ten, readable_seconds};
use crate::report::race::Lead;
use core::fmt::Write;
use maud::{Markup, html};

/// Curve.
pub(super) struct Series {
    /// Name in the legend.
    pub(super) name: String,
    /// Number of its colour and dash in the style sheet.
    pub(super) style: usize,
    /// Seconds and error.
    pub(super) points: Vec<[f64; 2]>,
    /// Seconds, and the ends of the interval.
    pub(super) band: Vec<[f64; 3]>,
    /// Line through the points.
    pub(super) fit: Option<Fit>,
}

/// Curves on common axes.
pub(super) struct Chart {
    /// Description for screen readers.
    pub(super) title: String,
    pub(super) series: Vec<Series>,
    /// Leaders over time, in a strip at the axis.
    pub(super) leads: Vec<Lead>,
}

/// Number of styles in the style sheet.
pub(super) const STYLES: usize = 6;

/// Distance in ln(seconds) below which points merge.
const MIN_DISTANCE: f64 = 0.004;

/// Number of points up to which each has a mark.
const MAX_MARKS: usize = 40;

/// Margins of the plot.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 46.0;

/// Classes, widths and heights of the three plots.
const SIZES: [(&str, f64, f64); 3] =
    [("wide", 1080.0, 440.0), ("medium", 680.0, 380.0), ("narrow", 360.0, 330.0)];

impl Series {
    /// Class of the style sheet.
    fn class(&self) -> String {
        format!("s{}", self.style % STYLES)
    }
}

impl Chart {
    /// Chart with its legend; empty without curves.
    pub(super) fn figure(&self) -> Markup {
        let Some([x, y]) = self.axes() else { return html! {} };
        html! {
            div.chart {
                (self.legend())
                @for (class, width, height) in SIZES { (Plot { width, height, x, y }.svg(self, class)) }
            }
        }
    }

    fn legend(&self) -> Markup {
        let entry = |sample: &Markup, name: &str| {
            html! { li { svg viewBox="0 0 28 8" aria-hidden="true" { (sample) } (name) } }
        };
        let line = |class: &str| html! { path class=(class) d="M0 4H28" {} };
        let band = html! { rect class="band s0" width="28" height="8" {} };
        html! {
            ul.legend {
                @for series in &self.series {
                    (entry(&line(&format!("curve {}", series.class())), &series.name))
                }
                @if self.series.iter().any(|series| !series.band.is_empty()) { (entry(&band, "95 % \
                interval")) }
                @if self.series.iter().any(|series| series.fit.is_some()) { (entry(&line("fit"), "fitted \
                line")) }
            }
        }
    }

    /// Axes around all points and bands.
    fn axes(&self) -> Option<[Axis; 2]> {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let bands = self.series.iter().flat_map(|series| &series.band);
        let x = Axis::close(points().map(|point| point[0]))?;
        // Intervals far below the curve would flatten it.
        let lowest = points().map(|point| point[1]).fold(f64::INFINITY, f64::min);
        let y =
            Axis::around(points().map(|p| p[1]).chain(bands.flat_map(|b| [b[1].max(0.5 * lowest), b[2]])))?;
        Some([x, y])
    }
}

/// Logarithmic axis.
#[derive(Clone, Copy)]
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    /// Axis from the last round number below the positive `values` to the first above.
    fn around(values: impl Iterator<Item = f64>) -> Option<Axis> {
        let (low, high) = ends(values);
        let rounds = || (-324..309).flat_map(|decade| [1.0, 2.0, 5.0].map(|d| d * 10f64.powi(decade)));
        let low = rounds().rfind(|&r| r > 0.0 && r <= low * (1.0 + 1e-9))?;
        let high = rounds().find(|&r| r >= high * (1.0 - 1e-9) && r > low && r.is_finite())?;
        (low < high).then_some(Axis { low, high })
    }

    /// Axis from slightly below the positive `values` to slightly above.
    fn close(values: impl Iterator<Item = f64>) -> Option<Axis> {
        let (low, high) = ends(values);
        let margin = (high / low).powf(0.02).max(1.1);
        (low <= high).then_some(Axis { low: low / margin, high: high * margin })
    }

    /// Position of a value, from 0 at the low end to 1.
    fn position(&self, value: f64) -> f64 {
        (value / self.low).ln() / (self.high / self.low).ln()
    }

    /// Grid values, and whether each has a label: every decade; 2 and 5 on short axes; all digits within a
    /// decade.
    fn ticks(&self) -> Vec<(f64, bool)> {
        let decades = (self.high / self.low).log10();
        let first = self.low.log10().floor() as i32;
        let last = self.high.log10().ceil() as i32;
        let step = (decades / 8.0).ceil().max(1.0) as i32;
        let digits = (1..10).filter(|digit| [1, 2, 5].contains(digit) || decades < 0.8);
        let ticks = (first..=last).flat_map(|decade| {
            digits.clone().map(move |digit| {
                let has_label = if digit == 1 { decade % step == 0 } else { decades < 2.3 };
                (f64::from(digit) * 10f64.powi(decade), has_label)
            })
        });
        let inside = |value: f64| value >= self.low * (1.0 - 1e-9) && value <= self.high * (1.0 + 1e-9);
        ticks.filter(|&(value, has_label)| inside(value) && (has_label || decades < 5.0)).collect()
    }
}

/// Smallest and largest of the positive `values`.
fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let positive = values.filter(|value| *value > 0.0 && value.is_finite());
    positive.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), value| (low.min(value), high.max(value)))
}

/// Shortest label of a grid value.
fn label(value: f64, is_seconds: bool) -> String {
    let decade = value.log10().floor() as i32;
    let digit = (value / 10f64.powi(decade)).round();
    match (digit, decade) {
        (_, 0..=3) => format!("{value:.0}"),
        (_, -2..=-1) => format!("{value:.*}", -decade as usize),
        (_, -3) if is_seconds => format!("{value:.3}"),
        (1.0, _) => power_of_ten(decade),
        _ => number(value, 1).replace(' ', ""),
    }
}

/// Coordinate in tenths of a pixel.
fn px(value: f64) -> String {
    format!("{value:.1}")
}

/// Chart of one size, in units of about a pixel.
struct Plot {
    width: f64,
    height: f64,
    x: Axis,
    y: Axis,
}

impl Plot {
    fn x(&self, seconds: f64) -> f64 {
        LEFT + self.x.position(seconds) * (self.width - LEFT - RIGHT)
    }

    /// Coordinate of an error, clamped to the lower end of the axis.
    fn y(&self, error: f64) -> f64 {
        let position = self.y.position(error.max(self.y.low));
        self.height - BOTTOM - position * (self.height - TOP - BOTTOM)
    }

    fn svg(&self, chart: &Chart, class: &str) -> Markup {
        let view_box = format!("0 0 {} {}", self.width, self.height);
        html! {
            svg class={ "plot " (class) } viewBox=(view_box) role="img" aria-label=(chart.title) {
                (self.grid())
                @for series in &chart.series { (self.series(series)) }
                (self.leads(chart))
            }
        }
    }

    fn grid(&self) -> Markup {
        let (left, right, top, bottom) = (LEFT, self.width - RIGHT, TOP, self.height - BOTTOM);
        let middle = 0.5 * (top + bottom);
        let class = |has_label: bool| (!has_label).then_some("minor");
        html! {
            @for (seconds, has_label) in self.x.ticks() {
                @let x = px(self.x(seconds));
                path class=[class(has_label)] d=(format!("M{x} {top}V{bottom}")) {}
                @if has_label { text.below x=(x) y=(bottom + 18.0) { (label(seconds, true)) } }
            }
            @for (error, has_label) in self.y.ticks() {
                @let y = self.y(error);
                path class=[class(has_label)] d=(format!("M{left} {y:.1}H{right}")) {}
                @if has_label { text.beside x=(left - 8.0) y=(px(y + 4.5)) { (label(error, false)) } }
            }
            text class="axis below" x=(0.5 * (left + right)) y=(self.height - 6.0) { "seconds of rendering" }
            text class="axis below" transform=(format!("translate(14 {middle}) rotate(-90)")) { "relMSE" }
        }
    }

    fn series(&self, series: &Series) -> Markup {
        let class = series.class();
        let band = thinned(&series.band, |point| point[0]);
        let upper = band.iter().map(|[t, _, upper]| (*t, *upper));
        let lower = band.iter().rev().map(|[t, lower, _]| (*t, *lower));
        let points = thinned(&series.points, |point| point[0]);
        let fit = series.fit.as_ref().zip(points.first().zip(points.last()));
        let fit = fit.map(|(fit, (first, last))| {
            [first[0].max(fit.from), last[0]].map(|seconds| (seconds, fit.error_at(seconds)))
        });
        html! {
            @if band.len() > 1 {
                path class={ "band " (class) } d={ (self.path(upper.chain(lower))) "Z" } {}
            }
            @if let Some(ends) = fit { path.fit d=(self.path(ends.into_iter())) {} }
            path class={ "curve " (class) } d=(self.path(points.iter().map(|point| (point[0], point[1])))) {}
            @for [seconds, error] in points.iter().filter(|_| points.len() <= MAX_MARKS) {
                circle class=(class) cx=(px(self.x(*seconds))) cy=(px(self.y(*error))) r="3" {
                    title {
                        (series.name) ": " (number(*error, 3)) " after " (readable_seconds(*seconds))
                    }
                }
            }
        }
    }

    fn leads(&self, chart: &Chart) -> Markup {
        let y = self.height - BOTTOM - 7.0;
        html! {
            @for lead in &chart.leads {
                @let series = lead.leader.and_then(|leader| chart.series.get(leader));
                @let class = series.map_or("open".into(), Series::class);
                @let (x, end) = (self.x(lead.from), self.x(lead.to));
                rect class={ "lead " (class) } x=(px(x)) y=(y) width=(px(end - x)) height="7" {
                    title { (series.map_or("no clear leader", |series| &series.name)) }
                }
            }
        }
    }

    fn path(&self, points: impl Iterator<Item = (f64, f64)>) -> String {
        let mut path = String::new();
        for (seconds, error) in points.filter(|(seconds, error)| *seconds > 0.0 && error.is_finite()) {
            let sign = if path.is_empty() { 'M' } else { 'L' };
            // Writing to a string does not fail.
            let _ = write!(path, "{sign}{:.1} {:.1}", self.x(seconds), self.y(error));
        }
        path
    }
}

/// Points at visible distances, and the last one.
fn thinned<T: Copy>(points: &[T], seconds: impl Fn(&T) -> f64) -> Vec<T> {
    let mut kept: Vec<T> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let is_far = kept.last().is_none_or(|last| seconds(point) >= seconds(last) * (1.0 + MIN_DISTANCE));
        if is_far || index + 1 == points.len() {
            kept.push(*point);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_at_round_numbers() {
        let axis = Axis::around([0.031, 7.0].into_iter()).unwrap();
        assert!((axis.low - 0.02).abs() < 1e-9 && axis.high == 10.0);
        assert!(axis.position(axis.low).abs() < 1e-12 && (axis.position(10.0) - 1.0).abs() < 1e-12);
        assert!(axis.ticks().iter().any(|&(value, has_label)| value == 1.0 && has_label));
        let point = Axis::around([1.0].into_iter()).unwrap();
        assert_eq!((point.low, point.high), (1.0, 2.0));
        assert!(Axis::around([0.0, f64::NAN, f64::INFINITY].into_iter()).is_none());
        let close = Axis::close([2.0, 8.0].into_iter()).unwrap();
        assert!(close.low < 2.0 && close.low > 1.8 && close.high > 8.0);
        assert!(Axis::close([0.0].into_iter()).is_none());
        assert!(Axis::around([1e-300, 1e300].into_iter()).unwrap().ticks().len() < 20);
    }

    #[test]
    fn labels_are_short() {
        assert_eq!(
            [0.01, 0.5, 2.0, 1000.0, 1e4].map(|v| label(v, true)),
            ["0.01", "0.5", "2", "1000", "10⁴"]
        );
        assert_eq!([2e-3, 1e-3, 5e-6].map(|v| label(v, false)), ["2×10⁻³", "10⁻³", "5×10⁻⁶"]);
    }

    #[test]
    fn long_curves_are_thinned_and_names_escaped() {
        let points: Vec<[f64; 2]> = (1..5000).map(|i| [f64::from(i), 1.0 / f64::from(i)]).collect();
        let kept = thinned(&points, |point| point[0]);
        assert!(kept.len() < 1000 && kept.last() == points.last());
        let series = Series { name: "<a>".into(), style: 9, points, band: vec![], fit: None };
        let chart = Chart { title: "\"t\"".into(), series: vec![series], leads: vec![] };
        let figure = chart.figure().into_string();
        assert!(!figure.contains("<a>") && figure.contains("&lt;a&gt;") && figure.contains("&quot;t&quot;"));
        assert_eq!(Chart { title: String::new(), series: vec![], leads: vec![] }.figure().into_string(), "");
    }
}
