//! Page of one render.

use super::map::{Map, difference};
use super::picture::{exposable, reduced};
use super::{audit, cache_survey, document, error, parts, photon_maps};
use crate::compare::Shown;
use crate::render::Ending;
use crate::report::Run;
use crate::report::quantity::{grouped, number, plural, readable_bytes, readable_seconds};
use crate::save::Image;
use maud::{Markup, html};

/// Radius in pixels of the smoothing of error maps: a variance from two halves is itself off by a factor.
const SMOOTHING: usize = 1;

/// Whole page.
pub(in crate::report) fn page(run: &Run) -> String {
    let chart = error::chart(run);
    let main = html! {
        (first(run))
        section {
            h2 { "Error against run time" }
            (error::slopes(&chart))
            (chart.figure())
            details { summary { "Rounds" } (error::rounds(run)) }
            p.note {
                (parts::relmse_definition())
                "Without a reference the error is estimated from two halves of the picture with independent \
                samples. It covers noise that was sampled, but not light that no sample has found."
            }
        }
        (audit::section(run))
        (reference(run))
        section {
            h2 { "Maps of the error" }
            div.maps { (maps(run)) (audit::map(run)) (samples(run)) }
            p.note { (note(run)) }
        }
        (parts::findings(run))
        (cache_survey::section(run))
        (photon_maps::section(run))
        (parts::resources(run))
        (parts::scene(run))
        section { h2 { "Dropped samples" } (parts::dropped(run)) }
        (parts::made(run.provenance, run))
    };
    document(run.name, None, &main)
}

/// Section of the picture with the main numbers.
fn first(run: &Run) -> Markup {
    let result = run.result;
    let (picture, factor) = reduced(&result.image);
    let speed = result.counters.all_rays() as f64 / result.seconds.render.max(1e-9) * 1e-6;
    let facts = [
        ("Samples per pixel", grouped(result.spp.into())),
        ("Rendering", readable_seconds(result.seconds.render)),
        ("Error estimation", readable_seconds(result.seconds.estimate)),
        ("Rays per second", format!("{} million", number(speed, 2))),
        ("Peak memory", readable_bytes(result.memory_peak)),
        ("Dropped samples", grouped(result.counters.dropped.total())),
    ];
    let ending = match result.ending {
        Ending::Done => "",
        Ending::Interrupted => " The render was stopped early.",
        Ending::Biased => {
            " The render stopped because the bias alone exceeds the requested error: more samples do not \
            help, another method may."
        }
        Ending::NoiseFloor => {
            " The render stopped because noise that all samples share exceeds the requested error: more \
            samples do not help."
        }
    };
    html! {
        section class={ "first " (layout(&picture)) } aria-label="Picture" {
            figure.picture {
                (exposable(&picture, &format!("Picture of {}", run.name)))
                figcaption { (parts::exposure(true)) (reduction(factor)) }
            }
            div {
                p.lead { (error::lead(run)) (ending) }
                dl.facts { (parts::facts(&facts)) }
            }
        }
    }
}

/// Class of the style sheet: pictures that are not wide have text beside them.
pub(super) fn layout(image: &Image) -> &'static str {
    if image.width > image.height / 5 * 7 { "wide" } else { "tall" }
}

/// Note on a reduced picture.
pub(super) fn reduction(factor: u32) -> Markup {
    html! { @if factor > 1 { p { "Shown at 1/" (factor) " of its size." } } }
}

/// Maps of the estimated error of each pixel.
fn maps(run: &Run) -> Markup {
    let result = run.result;
    if result.error.is_none() {
        return html! {};
    }
    let width = result.image.width;
    let mean = |pixel: &[f32; 3]| pixel.iter().sum::<f32>() / 3.0;
    // Two passes turn a bright pixel into a soft spot instead of a square.
    let map = |values: Vec<f32>| Map { width, values }.smoothed(SMOOTHING).smoothed(SMOOTHING);
    let root = |map: Map| Map { values: map.values.iter().map(|value| value.sqrt()).collect(), ..map };
    let variance: Vec<f32> = result.variance.pixels.iter().map(mean).collect();
    let whole = result.image.mean().iter().sum::<f64>() / 3.0;
    let floor = (0.01 * whole * whole) as f32;
    let pixels = result.variance.pixels.iter().zip(&result.image.pixels);
    let relative = pixels.map(|(v, i)| mean(&core::array::from_fn(|c| v[c] / (i[c] * i[c] + floor))));
    let of_sample = variance.iter().zip(&result.samples).map(|(v, &n)| v * n as f32).collect();
    html! {
        (root(map(variance.clone())).figure(
            "Standard error",
            "Standard deviation of the mean of each pixel, in W/(m²\u{a0}sr).",
        ))
        (root(map(relative.collect())).figure(
            "Relative error",
            "Standard error over the brightness of the pixel, as in relMSE: bright pixels dominate the \
            error.",
        ))
        (map(of_sample).figure(
            "Variance of a sample",
            "Noise of the light for any number of samples, in (W/(m²\u{a0}sr))².",
        ))
    }
}

/// Map of samples per pixel, if they differ by more than one.
fn samples(run: &Run) -> Markup {
    match least_and_most(run) {
        Some((least, most)) if most > least + 1 => {
            let values = run.result.samples.iter().map(|&count| count as f32).collect();
            let map = Map { width: run.result.image.width, values };
            map.counts_figure("Samples", "Samples of each pixel.", least, most)
        }
        _ => html! {},
    }
}

fn least_and_most(run: &Run) -> Option<(u32, u32)> {
    let samples = &run.result.samples;
    Some((*samples.iter().min()?, *samples.iter().max()?))
}

/// Note under the maps.
fn note(run: &Run) -> String {
    let samples = match least_and_most(run) {
        Some((least, most)) if least == most => {
            format!("Every pixel has {}. ", plural(least.into(), "sample"))
        }
        Some((least, most)) if most == least + 1 => {
            format!("Every pixel has {least} or {most} samples: the time ended within a round. ")
        }
        _ => String::new(),
    };
    let maps = run.result.error.map_or("An error estimate needs four samples.", |_| {
        "Errors are estimated from the halves of each pixel and averaged over a few pixels. Scales are \
        logarithmic and leave out the lowest 1\u{202f}% and the highest 0.5\u{202f}% of the pixels."
    });
    samples + maps
}

/// Section of the comparison with a reference; empty without one.
fn reference(run: &Run) -> Markup {
    let (Some(reference), Some(comparison)) = (run.reference(), run.comparison) else { return html! {} };
    let (image, linear) = (&run.result.image, &comparison.linear);
    let values = |shown| comparison.values(image, reference, shown);
    let percent = 100.0 * (linear.mean / linear.reference_mean - 1.0);
    let sign = if percent > 0.0 { "+" } else { "" };
    let facts = [
        ("relMSE", number(linear.relmse, 3)),
        ("RMSE", number(linear.rmse(), 3)),
        ("FLIP", number(comparison.flip, 3)),
        ("Mean, against the reference", format!("{sign}{}\u{202f}%", number(percent, 2))),
    ];
    let [left, right] =
        [(image, "Picture"), (reference, "Reference")].map(|(image, alt)| exposable(&reduced(image).0, alt));
    html! {
        section {
            h2 { "Comparison with the reference" }
            dl class="facts row" { (parts::facts(&facts)) }
            figure class={ "picture " (layout(image)) } {
                (parts::split(&left, &right))
                figcaption {
                    p.sides { span { "picture" } span { "reference" } }
                    (parts::exposure(false))
                }
            }
            div.maps {
                (difference(
                    &values(Shown::Relative),
                    Shown::Relative,
                    "Relative difference",
                    "Blue is too dark, red is too bright. The mean square is the relMSE.",
                ))
                (difference(
                    &values(Shown::Flip),
                    Shown::Flip,
                    "FLIP",
                    "Visible difference of the PNGs at 67 pixels per degree, from 0 (none) to 1 (largest).",
                ))
            }
        }
    }
}
