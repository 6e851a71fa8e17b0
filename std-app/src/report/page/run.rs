//! The page of one render.

use super::map::{Map, difference};
use super::picture::{exposable, reduced};
use super::{audit, cache, error, escape, fill, parts, photons, shell};
use crate::compare::Shown;
use crate::drive::Ending;
use crate::report::Run;
use crate::report::words::{grouped, number, plural, readable_bytes, readable_seconds};
use crate::save::Image;

/// Pixels on each side over which the maps of the error are averaged for the eye: a variance from two halves
/// is itself off by a factor.
const SMOOTHING: usize = 1;

/// The whole page.
pub(in crate::report) fn page(run: &Run) -> String {
    let (picture, factor) = reduced(&run.result.image);
    let chart = error::chart(run);
    let body = fill(
        include_str!("run.html"),
        &[
            ("name", &escape(run.name)),
            ("layout", layout(&picture)),
            ("lead", &error::lead(run)),
            ("early", early(run)),
            ("picture", &exposable(&picture, &format!("The picture of {}", run.name))),
            ("smaller", &smaller(factor)),
            ("facts", &parts::facts(&facts(run))),
            ("slopes", &error::slopes(&chart)),
            ("chart", &chart.figure()),
            ("rounds", &error::rounds(run)),
            ("maps", &maps(run)),
            ("note", &note(run)),
            ("audit", &audit::section(run)),
            ("cache", &cache::section(run)),
            ("reference", &reference(run)),
            ("photons", &photons::section(run)),
            ("time", &parts::time(run)),
            ("memory", &parts::memory(run)),
            ("census", &parts::census(run)),
            ("left_out", &parts::left_out(run)),
            ("repairs", &parts::repairs(run)),
            ("ledger", &parts::ledger(run)),
            ("made", &parts::made(run.maker, run)),
        ],
    );
    shell(&format!("{} – halflight", run.name), &body)
}

fn early(run: &Run) -> &'static str {
    match run.result.ending {
        Ending::Done => "",
        Ending::Interrupted => " It was stopped early.",
        Ending::Biased => {
            " It was stopped because its bias alone is larger than the error that was asked for: more samples would \
             not help, another method would."
        }
        Ending::NoiseFloor => {
            " It was stopped because noise that all samples share stays above the error that was asked for: more \
             samples would not help."
        }
    }
}

/// Whether there is room for words beside a picture: its class in the style sheet.
pub(super) fn layout(image: &Image) -> &'static str {
    if image.width > image.height / 5 * 7 { "wide" } else { "tall" }
}

/// What is said of a picture that is shown smaller.
pub(super) fn smaller(factor: u32) -> String {
    if factor == 1 { String::new() } else { format!("<p>Shown at 1/{factor} of its size.</p>") }
}

fn facts(run: &Run) -> Vec<(&'static str, String)> {
    let result = run.result;
    let rays = result.counters.all_rays();
    let speed = rays as f64 / result.seconds.render.max(1e-9) * 1e-6;
    let dropped = match result.counters.dropped.total() {
        0 => "none".into(),
        count => grouped(count),
    };
    vec![
        ("Samples per pixel", grouped(result.spp.into())),
        ("Rendering", readable_seconds(result.seconds.render)),
        ("Estimating its error", readable_seconds(result.seconds.estimate)),
        ("Rays per second", format!("{} million", number(speed, 2))),
        ("Memory at the peak", readable_bytes(result.memory_peak)),
        ("Dropped samples", dropped),
    ]
}

/// The maps of what is known of each pixel.
fn maps(run: &Run) -> String {
    let result = run.result;
    let mut maps = String::new();
    if result.error.is_some() {
        let width = result.image.width;
        let mean = |pixel: &[f32; 3]| pixel.iter().sum::<f32>() / 3.0;
        // Twice, so that a bright pixel becomes a soft spot and not a square.
        let map = |values: Vec<f32>| Map { width, values }.smoothed(SMOOTHING).smoothed(SMOOTHING);
        let root = |map: Map| Map { values: map.values.iter().map(|value| value.sqrt()).collect(), ..map };
        let variance: Vec<f32> = result.variance.pixels.iter().map(mean).collect();
        let whole = result.image.mean().iter().sum::<f64>() / 3.0;
        let floor = (0.01 * whole * whole) as f32;
        let pixels = result.variance.pixels.iter().zip(&result.image.pixels);
        let relative = pixels.map(|(v, i)| mean(&core::array::from_fn(|c| v[c] / (i[c] * i[c] + floor))));
        let each = variance.iter().zip(&result.samples).map(|(v, &n)| v * n as f32);
        maps += &root(map(variance.clone())).figure(
            "Standard error",
            "How far each pixel is likely to be from the truth: the standard deviation of its mean, in W/(m²\u{a0}sr).",
        );
        maps += &root(map(relative.collect())).figure(
            "Relative error",
            "The same over the brightness of the pixel, as relMSE counts it: where this is bright, the error is made.",
        );
        maps += &map(each.collect()).figure(
            "Variance of a sample",
            "How noisy the light is there, however many samples are taken, in (W/(m²\u{a0}sr))².",
        );
    }
    maps + &audit::map(run) + &samples(run)
}

/// The map of samples, where they differ by more than the end of the last round.
fn samples(run: &Run) -> String {
    match least_and_most(run) {
        Some((least, most)) if most > least + 1 => {
            let values = run.result.samples.iter().map(|&count| count as f32).collect();
            let map = Map { width: run.result.image.width, values };
            map.counts_figure("Samples", "How many samples each pixel has.", least, most)
        }
        _ => String::new(),
    }
}

fn least_and_most(run: &Run) -> Option<(u32, u32)> {
    let samples = &run.result.samples;
    Some((*samples.iter().min()?, *samples.iter().max()?))
}

/// The words under the maps.
fn note(run: &Run) -> String {
    let samples = match least_and_most(run) {
        Some((least, most)) if least == most => {
            format!("Every pixel has {}. ", plural(least.into(), "sample"))
        }
        Some((least, most)) if most == least + 1 => {
            format!("Every pixel has {} or {most} samples: the time was over within a round. ", least)
        }
        _ => String::new(),
    };
    let maps = run.result.error.map_or("What its error is would take four samples to tell.", |_| {
        "Errors are estimated from the halves of each pixel and averaged over a few pixels for the eye. Their scales \
         are logarithmic and leave out the lowest hundredth and the highest two-hundredth of the pixels."
    });
    samples + maps
}

/// The section that lays the picture beside its reference.
fn reference(run: &Run) -> String {
    let (Some(reference), Some(comparison)) = (run.reference(), run.comparison) else { return String::new() };
    let image = &run.result.image;
    let values = |shown| comparison.values(image, reference, shown);
    let maps = difference(
        &values(Shown::Relative),
        Shown::Relative,
        "Relative difference",
        "Blue where the picture is too dark, red where it is too bright; the mean of the square is the relMSE.",
    ) + &difference(
        &values(Shown::Flip),
        Shown::Flip,
        "FLIP",
        "How different it looks at 67 pixels per degree, as a PNG shows it: 0 not at all, 1 as much as can be.",
    );
    let linear = &comparison.linear;
    let percent = 100.0 * (linear.mean / linear.reference_mean - 1.0);
    let facts = [
        ("relMSE", number(linear.relmse, 3)),
        ("RMSE", number(linear.rmse(), 3)),
        ("FLIP", number(comparison.flip, 3)),
        (
            "Mean, against the reference",
            format!("{}{}&#8239;%", if percent > 0.0 { "+" } else { "" }, number(percent, 2)),
        ),
    ];
    fill(
        include_str!("reference.html"),
        &[
            ("layout", layout(image)),
            ("picture", &exposable(&reduced(image).0, "The picture")),
            ("reference", &exposable(&reduced(reference).0, "The reference")),
            ("facts", &parts::facts(&facts)),
            ("maps", &maps),
        ],
    )
}
