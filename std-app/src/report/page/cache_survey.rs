//! Survey of the irradiance cache as maps: records, radii, predicted and true error.

use super::map::{Map, difference};
use super::picture::{img, reduced};
use crate::compare::Shown;
use crate::render::{Check, Mark, Survey, SurveyPixel};
use crate::report::Run;
use crate::report::quantity::plural;
use crate::save::{Image, from_srgb};
use maud::{Markup, html};

/// Display colours of the borders and of the centres of records.
const BORDER: [f32; 3] = [0.55, 0.9, 1.0];
const CENTRE: [f32; 3] = [1.0, 0.55, 0.1];

/// Factor that darkens the picture below the records.
const DIMMED: f32 = 0.4;

/// Section of the survey; empty without one.
pub(super) fn section(run: &Run) -> Markup {
    let Some(survey) = &run.result.survey else { return html! {} };
    let map = |value: fn(&SurveyPixel) -> f32| Map {
        width: survey.width,
        values: survey.pixels.iter().map(value).collect(),
    };
    html! {
        section {
            h2 { "Records of the irradiance cache" }
            div.maps {
                (records(run, survey))
                (map(|pixel| pixel.radius).figure(
                    "Radii",
                    "Mean validity radius of the records at a pixel, in pixels. Black pixels have no record \
                    and are path traced.",
                ))
                (map(|pixel| pixel.predicted).figure(
                    "Predicted error",
                    "Error that the records predict, relative to the irradiance.",
                ))
                (difference(
                    &errors(run, survey),
                    Shown::Relative,
                    "True error",
                    "Relative error at the test points: blue is too dark, red is too bright, white was not \
                    tested.",
                ))
            }
            p.note {
                "The true error is that of the mean of both caches at " (plural(survey.points, "point")) ", \
                against 2 × 4096 gather rays. The noise of these rays is part of the achieved error but not \
                of its root mean square. Errors are relative to the irradiance, or to a tenth of its mean if \
                that is larger. The prediction covers interpolation, up to 100\u{202f}%, but not the noise \
                of records."
            }
        }
    }
}

/// Picture with the records of one cache over it.
fn records(run: &Run, survey: &Survey) -> Markup {
    let image = &run.result.image;
    let below = |x: u32, y: u32| {
        let (x, y) = ((x * survey.step).min(image.width - 1), (y * survey.step).min(image.height - 1));
        image.pixels[(y * image.width + x) as usize].map(|value| DIMMED * value.clamp(0.0, 1.0))
    };
    let pixels = survey.pixels.iter().zip(0..).map(|(pixel, i)| match pixel.mark {
        Mark::None => below(i % survey.width, i / survey.width),
        Mark::Rim => BORDER.map(from_srgb),
        Mark::Record => CENTRE.map(from_srgb),
    });
    let height = survey.pixels.len() as u32 / survey.width.max(1);
    let drawn = Image { width: survey.width, height, pixels: pixels.collect() };
    html! {
        figure {
            (img(&reduced(&drawn).0, "Records and their borders over the picture"))
            figcaption {
                h3 { "Records" }
                p { "Records of the cache of even samples: dots are records, lines are the borders of their \
                validity." }
            }
        }
    }
}

/// Relative errors at the test points, one square each.
fn errors(run: &Run, survey: &Survey) -> Image {
    let Image { width, height, .. } = run.result.image;
    let mut values = Image::black(width, height);
    for Check { pixel: [x, y], error, .. } in &survey.checks {
        for row in *y..(y + survey.square).min(height) {
            let row = (row * width) as usize;
            let right = (x + survey.square).min(width);
            values.pixels[row + *x as usize..row + right as usize].fill([*error; 3]);
        }
    }
    values
}
