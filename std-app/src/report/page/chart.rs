//! Curves of error against time as SVG on logarithmic axes. Colours come from the style of the page, so that a
//! chart follows it into the dark; every chart is drawn for windows of three widths, and one is shown.

use super::escape;
use crate::report::fit::Fit;
use crate::report::race::Lead;
use crate::report::words::{number, power_of_ten, readable_seconds};
use core::fmt::Write;

/// Writes to a string, which does not fail.
macro_rules! put {
    ($text:ident, $($arguments:tt)+) => {
        let _ = write!($text, $($arguments)+);
    };
}

/// A curve.
pub(super) struct Series {
    /// Its name.
    pub(super) name: String,
    /// Number of its colour and dash in the style sheet.
    pub(super) style: usize,
    /// Seconds and error.
    pub(super) points: Vec<[f64; 2]>,
    /// Seconds, and the ends of the interval.
    pub(super) band: Vec<[f64; 3]>,
    /// The line through them.
    pub(super) fit: Option<Fit>,
}

/// Curves together.
pub(super) struct Chart {
    /// What it shows, for those who do not see it.
    pub(super) title: String,
    pub(super) series: Vec<Series>,
    /// Who is ahead when; a strip along the axis.
    pub(super) leads: Vec<Lead>,
}

/// Colours in the style sheet.
pub(super) const STYLES: usize = 6;

/// Points closer than this in ln(seconds) are not told apart.
const NEAR: f64 = 0.004;

/// Points up to which each has a mark.
const MARKED: usize = 40;

/// Margins around the plot.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 46.0;

impl Chart {
    /// The chart and its legend; nothing where there are no curves.
    pub(super) fn figure(&self) -> String {
        let Some([x, y]) = self.axes() else { return String::new() };
        let sizes = [("wide", 1080.0, 440.0), ("medium", 680.0, 380.0), ("narrow", 360.0, 330.0)];
        let plots =
            sizes.map(|(class, width, height)| Plot { width, height, x, y }.svg(self, class)).concat();
        format!("<div class=\"chart\">{}{plots}</div>", self.legend())
    }

    fn legend(&self) -> String {
        let entry = |series: &Series| {
            let style = series.style % STYLES;
            let line = format!(
                "<svg viewBox=\"0 0 28 8\" aria-hidden=\"true\"><path class=\"curve s{style}\" d=\"M0 4H28\"/></svg>"
            );
            format!("<li>{line}{}</li>", escape(&series.name))
        };
        let mut entries: String = self.series.iter().map(entry).collect();
        if self.series.iter().any(|series| !series.band.is_empty()) {
            entries += "<li><svg viewBox=\"0 0 28 8\" aria-hidden=\"true\"><rect class=\"band s0\" width=\"28\" height=\"8\"/></svg>\
                        95 % interval</li>";
        }
        if self.series.iter().any(|series| series.fit.is_some()) {
            entries += "<li><svg viewBox=\"0 0 28 8\" aria-hidden=\"true\"><path class=\"fit\" d=\"M0 4H28\"/></svg>fitted line</li>";
        }
        format!("<ul class=\"legend\">{entries}</ul>")
    }

    /// Axes that hold all points and bands.
    fn axes(&self) -> Option<[Axis; 2]> {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let bands = self.series.iter().flat_map(|series| &series.band);
        let x = Axis::close(points().map(|point| point[0]))?;
        // Intervals that reach far below the curve would flatten it.
        let lowest = points().map(|point| point[1]).fold(f64::INFINITY, f64::min);
        let y =
            Axis::around(points().map(|p| p[1]).chain(bands.flat_map(|b| [b[1].max(0.5 * lowest), b[2]])))?;
        Some([x, y])
    }
}

/// A logarithmic axis.
#[derive(Clone, Copy)]
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    /// From the last round number below the positive `values` to the first above.
    fn around(values: impl Iterator<Item = f64>) -> Option<Axis> {
        let (low, high) = ends(values);
        let rounds = || (-324..309).flat_map(|decade| [1.0, 2.0, 5.0].map(|d| d * 10f64.powi(decade)));
        let low = rounds().rfind(|&r| r > 0.0 && r <= low * (1.0 + 1e-9))?;
        let high = rounds().find(|&r| r >= high * (1.0 - 1e-9) && r > low && r.is_finite())?;
        (low < high).then_some(Axis { low, high })
    }

    /// From a little below the positive `values` to a little above.
    fn close(values: impl Iterator<Item = f64>) -> Option<Axis> {
        let (low, high) = ends(values);
        let little = (high / low).powf(0.02).max(1.1);
        (low <= high).then_some(Axis { low: low / little, high: high * little })
    }

    fn place(&self, value: f64) -> f64 {
        (value / self.low).ln() / (self.high / self.low).ln()
    }

    /// Values of the grid, and whether each has a label: every decade, 2 and 5 where there are few, and all digits
    /// within one.
    fn ticks(&self) -> Vec<(f64, bool)> {
        let decades = (self.high / self.low).log10();
        let first = self.low.log10().floor() as i32;
        let last = self.high.log10().ceil() as i32;
        let every = (decades / 8.0).ceil().max(1.0) as i32;
        let digits = (1..10).filter(|digit| [1, 2, 5].contains(digit) || decades < 0.8);
        let ticks = (first..=last).flat_map(|decade| {
            digits.clone().map(move |digit| {
                let labelled = if digit == 1 { decade % every == 0 } else { decades < 2.3 };
                (f64::from(digit) * 10f64.powi(decade), labelled)
            })
        });
        let inside = |value: f64| value >= self.low * (1.0 - 1e-9) && value <= self.high * (1.0 + 1e-9);
        ticks.filter(|&(value, labelled)| inside(value) && (labelled || decades < 5.0)).collect()
    }
}

/// The smallest and the largest of the positive `values`.
fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let positive = values.filter(|value| *value > 0.0 && value.is_finite());
    positive.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), value| (low.min(value), high.max(value)))
}

/// A value of the grid in as few signs as it takes.
fn label(value: f64, seconds: bool) -> String {
    let decade = value.log10().floor() as i32;
    let digit = (value / 10f64.powi(decade)).round();
    match (digit, decade) {
        (_, 0..=3) => format!("{value:.0}"),
        (_, -2..=-1) => format!("{value:.*}", -decade as usize),
        (_, -3) if seconds => format!("{value:.3}"),
        (1.0, _) => power_of_ten(decade),
        _ => number(value, 1).replace(' ', ""),
    }
}

/// A chart of a size, in units of about a pixel.
struct Plot {
    width: f64,
    height: f64,
    x: Axis,
    y: Axis,
}

impl Plot {
    fn x(&self, seconds: f64) -> f64 {
        LEFT + self.x.place(seconds) * (self.width - LEFT - RIGHT)
    }

    /// Nothing is drawn below the plot.
    fn y(&self, error: f64) -> f64 {
        let place = self.y.place(error.max(self.y.low));
        self.height - BOTTOM - place * (self.height - TOP - BOTTOM)
    }

    fn svg(&self, chart: &Chart, class: &str) -> String {
        let Plot { width, height, .. } = *self;
        let mut svg = format!(
            "<svg class=\"plot {class}\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">",
            escape(&chart.title)
        );
        self.grid(&mut svg);
        for series in &chart.series {
            self.series(&mut svg, series);
        }
        self.leads(&mut svg, chart);
        svg + "</svg>"
    }

    fn grid(&self, svg: &mut String) {
        let (left, right, top, bottom) = (LEFT, self.width - RIGHT, TOP, self.height - BOTTOM);
        for (seconds, labelled) in self.x.ticks() {
            let x = self.x(seconds);
            let class = if labelled { "" } else { " class=\"minor\"" };
            put!(svg, "<path{class} d=\"M{x:.1} {top}V{bottom}\"/>");
            if labelled {
                let y = bottom + 18.0;
                put!(svg, "<text class=\"below\" x=\"{x:.1}\" y=\"{y}\">{}</text>", label(seconds, true));
            }
        }
        for (error, labelled) in self.y.ticks() {
            let y = self.y(error);
            let class = if labelled { "" } else { " class=\"minor\"" };
            put!(svg, "<path{class} d=\"M{left} {y:.1}H{right}\"/>");
            if labelled {
                let (x, y) = (left - 8.0, y + 4.5);
                put!(svg, "<text class=\"beside\" x=\"{x}\" y=\"{y:.1}\">{}</text>", label(error, false));
            }
        }
        let (middle, foot) = (0.5 * (left + right), self.height - 6.0);
        put!(svg, "<text class=\"axis below\" x=\"{middle}\" y=\"{foot}\">seconds of rendering</text>");
        let middle = 0.5 * (top + bottom);
        put!(
            svg,
            "<text class=\"axis below\" transform=\"translate(14 {middle}) rotate(-90)\">relMSE</text>"
        );
    }

    fn series(&self, svg: &mut String, series: &Series) {
        let style = series.style % STYLES;
        let band = thinned(&series.band, |point| point[0]);
        if band.len() > 1 {
            let upper = band.iter().map(|[t, _, upper]| (*t, *upper));
            let lower = band.iter().rev().map(|[t, lower, _]| (*t, *lower));
            put!(svg, "<path class=\"band s{style}\" d=\"{}Z\"/>", self.path(upper.chain(lower)));
        }
        let points = thinned(&series.points, |point| point[0]);
        if let (Some(fit), Some(first), Some(last)) = (&series.fit, points.first(), points.last()) {
            let ends = [first[0].max(fit.from), last[0]].map(|seconds| (seconds, fit.at(seconds)));
            put!(svg, "<path class=\"fit\" d=\"{}\"/>", self.path(ends.into_iter()));
        }
        let path = self.path(points.iter().map(|point| (point[0], point[1])));
        put!(svg, "<path class=\"curve s{style}\" d=\"{path}\"/>");
        for [seconds, error] in points.iter().filter(|_| points.len() <= MARKED) {
            let (x, y) = (self.x(*seconds), self.y(*error));
            let words =
                format!("{}: {} after {}", series.name, number(*error, 3), readable_seconds(*seconds));
            put!(
                svg,
                "<circle class=\"s{style}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"><title>{}</title></circle>",
                escape(&words)
            );
        }
    }

    fn leads(&self, svg: &mut String, chart: &Chart) {
        let y = self.height - BOTTOM - 7.0;
        for lead in &chart.leads {
            let (x, width) = (self.x(lead.from), self.x(lead.to) - self.x(lead.from));
            let series = lead.who.and_then(|who| chart.series.get(who));
            let class = series.map_or("open".into(), |series| format!("s{}", series.style % STYLES));
            let name = series.map_or("too close to tell", |series| &series.name);
            put!(
                svg,
                "<rect class=\"lead {class}\" x=\"{x:.1}\" y=\"{y}\" width=\"{width:.1}\" height=\"7\"><title>{}</title></rect>",
                escape(name)
            );
        }
    }

    fn path(&self, points: impl Iterator<Item = (f64, f64)>) -> String {
        let mut path = String::new();
        for (seconds, error) in points.filter(|(seconds, error)| *seconds > 0.0 && error.is_finite()) {
            let sign = if path.is_empty() { 'M' } else { 'L' };
            put!(path, "{sign}{:.1} {:.1}", self.x(seconds), self.y(error));
        }
        path
    }
}

/// Points that can be told apart, the last always among them.
fn thinned<T: Copy>(points: &[T], seconds: impl Fn(&T) -> f64) -> Vec<T> {
    let mut kept: Vec<T> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let far = kept.last().is_none_or(|last| seconds(point) >= seconds(last) * (1.0 + NEAR));
        if far || index + 1 == points.len() {
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
        assert!(axis.place(axis.low).abs() < 1e-12 && (axis.place(10.0) - 1.0).abs() < 1e-12);
        assert!(axis.ticks().iter().any(|&(value, labelled)| value == 1.0 && labelled));
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
        let figure = chart.figure();
        assert!(!figure.contains("<a>") && figure.contains("&lt;a&gt;") && figure.contains("&quot;t&quot;"));
        assert_eq!(Chart { title: String::new(), series: vec![], leads: vec![] }.figure(), "");
    }
}
