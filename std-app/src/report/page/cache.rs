//! The irradiance cache: what was asked of it, what it predicts and what it reaches, and what it looks like.

use super::map::{Map, difference};
use super::picture::{img, reduced};
use super::{fill, parts};
use crate::compare::Shown;
use crate::drive::{Check, Mark, Survey};
use crate::report::Run;
use crate::report::words::{grouped, number, plural, readable_seconds};
use crate::save::{Image, from_srgb};

/// Display colours of rims and of records, and by how much the picture beneath them is darkened.
const RIM: [f32; 3] = [0.55, 0.9, 1.0];
const RECORD: [f32; 3] = [1.0, 0.55, 0.1];
const DARKER: f32 = 0.4;

/// The section of the cache; nothing where there was none.
pub(super) fn section(run: &Run) -> String {
    let Some(cache) = &run.result.cache else { return String::new() };
    let settings = run.settings.cache;
    let mut facts = vec![
        ("Records", grouped(cache.records)),
        ("Places gathered at", grouped(cache.gathered)),
        ("Rays of each", grouped(cache.rays.into())),
        ("Time of filling", readable_seconds(cache.seconds)),
        ("Error asked for", format!("{} ({})", number(settings.allowed().into(), 2), settings.metric.name())),
    ];
    if cache.loaded > 0 {
        facts.insert(1, ("of them loaded", grouped(cache.loaded)));
    }
    if cache.is_cut {
        facts.push(("Filling cut short", "by the limit of time, or an interruption".into()));
    }
    if cache.refused > 0 {
        facts.push(("Records that had no memory", grouped(cache.refused)));
    }
    let (mut maps, mut note, mut words) = (String::new(), String::new(), String::new());
    if let Some(survey) = &run.result.survey {
        facts.push(("Error predicted", parts::percent(survey.predicted)));
        facts.push(("Error achieved", parts::percent(survey.achieved)));
        facts.push(("Root mean square", parts::percent(survey.rms)));
        words = verdict(survey);
        maps = self::maps(run, survey);
        note = remark(survey);
    }
    fill(
        include_str!("cache.html"),
        &[("words", &words), ("facts", &parts::facts(&facts)), ("maps", &maps), ("note", &note)],
    )
}

fn verdict(survey: &Survey) -> String {
    let Survey { predicted, achieved, .. } = *survey;
    if survey.checks.is_empty() {
        return "No record reaches a point at which light was gathered to compare.".into();
    }
    let so = match predicted / achieved.max(f64::MIN_POSITIVE) {
        0.0 => "the metric predicts none, for it knows no Hessian".into(),
        ratio if ratio > 2.0 => format!("{} times less than predicted", number(ratio, 2)),
        ratio if ratio < 0.5 => format!("{} times what was predicted", number(1.0 / ratio, 2)),
        _ => "within a factor of two of what was predicted".into(),
    };
    format!("Its indirect irradiance is wrong by {} in the mean: {so}.", parts::percent(achieved))
}

fn remark(survey: &Survey) -> String {
    let reached = 100.0 * survey.checks.len() as f64 / survey.points.max(1) as f64;
    format!(
        "The error that was achieved is that of the mean of both caches at {}, of which records reach {}&#8239;%. There, \
         2 times 4096 rays were gathered to compare with, whose own noise is {}; it is part of the mean, and taken off the \
         root mean square. Errors are relative to the irradiance, or to a tenth of its mean where that is more. What is \
         predicted is an error of interpolation between records, at most 100&#8239;%, without the noise of their rays. This took {}.",
        plural(survey.points, "point"),
        number(reached, 3),
        parts::percent(survey.noise),
        readable_seconds(survey.seconds),
    )
}

fn maps(run: &Run, survey: &Survey) -> String {
    let map = |of: fn(&crate::drive::Look) -> f32| Map {
        width: survey.width,
        values: survey.looks.iter().map(of).collect(),
    };
    records(run, survey)
        + &map(|look| look.radius).figure(
            "Radii",
            "How far records reach, in pixels: the mean of those that speak at a place. Where it is black none does, and \
             light is path traced.",
        )
        + &map(|look| look.predicted).figure("Predicted error", "What the records predict, relative to the irradiance.")
        + &difference(
            &checks(run, survey),
            Shown::Relative,
            "True error",
            "Where light was gathered to compare: blue where the cache is too dark, red where it is too bright; white \
             where nothing was compared.",
        )
}

/// The picture with the records of one cache drawn over it.
fn records(run: &Run, survey: &Survey) -> String {
    let image = &run.result.image;
    let under = |x: u32, y: u32| {
        let (x, y) = ((x * survey.step).min(image.width - 1), (y * survey.step).min(image.height - 1));
        image.pixels[(y * image.width + x) as usize].map(|value| DARKER * value.clamp(0.0, 1.0))
    };
    let pixels = survey.looks.iter().zip(0..).map(|(look, i)| match look.mark {
        Mark::None => under(i % survey.width, i / survey.width),
        Mark::Rim => RIM.map(from_srgb),
        Mark::Record => RECORD.map(from_srgb),
    });
    let height = survey.looks.len() as u32 / survey.width.max(1);
    let drawn = Image { width: survey.width, height, pixels: pixels.collect() };
    let image = img(&reduced(&drawn).0, "Records and their rims over the picture");
    let words = "Those of the cache of even samples: a dot is a record, a line the rim of what it covers.";
    format!("<figure>\n{image}\n<figcaption>\n<h3>Records</h3>\n<p>{words}</p>\n</figcaption>\n</figure>\n")
}

/// The relative errors, each as a square.
fn checks(run: &Run, survey: &Survey) -> Image {
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
