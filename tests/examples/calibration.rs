//! Does the interval hold the error, and does a render that stops by its error have it? Renders scenes with
//! many seeds until they say that they have the error asked for; each round is compared with a reference of
//! many times the samples, whose own noise is taken off, and what photons blur in it. Prints the tables of
//! docs/validation.md:
//!
//! `cargo run --release -p halflight-tests --example calibration -- [--renders 40] [--size 64] [--error
//! 0.001] [--spp 4096] [--times 100] [--method path] [--audit 0.05] [SCENE…]`, of our own scenes by name or
//! of any scene file. `--error 0` goes on to the last sample, also where a method's bias is found.

use core::sync::atomic::AtomicBool;
use halflight::load::{self, LoadOptions};
use halflight::render::{ErrorEstimate, Method, RenderResult, Round, Settings, Stop, render};
use halflight::save::Image;
use halflight_core::estimate::relmse;
use halflight_tests::render::raw;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Samples of a reference over those of the one that is blurred three times as much.
const FEWER: u32 = 27;

/// Seeds of renders count from 0.
const REFERENCE_SEED: u32 = u32::MAX;

const SCENES: [&str; 4] = ["cornell.obj", "glossy.toml", "two-rooms.toml", "caustic.toml"];

/// What is asked for.
struct Wanted {
    renders: u32,
    size: u32,
    error: f64,
    spp: u32,
    /// Samples of the reference over those of a render.
    times: u32,
    method: Option<Method>,
    audit: Option<f64>,
}

fn main() {
    let mut wanted =
        Wanted { renders: 40, size: 64, error: 0.001, spp: 4096, times: 100, method: None, audit: None };
    let mut scenes = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().expect("a value after the flag");
        match argument.as_str() {
            "--renders" => wanted.renders = value().parse().expect("a number of renders"),
            "--size" => wanted.size = value().parse().expect("a number of pixels"),
            "--error" => wanted.error = value().parse().expect("an error"),
            "--spp" => wanted.spp = value().parse().expect("a number of samples"),
            "--times" => wanted.times = value().parse().expect("a number of times"),
            "--method" => wanted.method = Some(Method::named(&value()).expect("a method")),
            "--audit" => wanted.audit = Some(value().parse().expect("a share")),
            scene => scenes.push(scene.to_owned()),
        }
    }
    println!("| scene | samples | relMSE | estimate / error | upper end / estimate | held | below, above |");
    println!("|---|---|---|---|---|---|---|");
    if scenes.is_empty() {
        scenes.extend(SCENES.map(String::from));
    }
    for scene in &scenes {
        calibrate(&find(scene), &wanted);
    }
}

fn find(name: &str) -> PathBuf {
    if Path::new(name).exists() {
        return name.into();
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let file = SCENES.into_iter().find(|scene| scene.starts_with(name)).unwrap_or(name);
    folder.join(file.split('.').next().unwrap_or(file)).join(file)
}

fn calibrate(file: &Path, wanted: &Wanted) {
    let loaded = load::load(file, &LoadOptions::default()).expect("a scene");
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let run =
        |settings| render(&scene, &settings, &mut |_| (), &AtomicBool::new(false)).expect("enough memory");

    let error = Some(wanted.error).filter(|error| *error > 0.0);
    let stop = Stop { error, spp: Some(wanted.spp), seconds: None };
    let settings = |seed| settings(wanted, seed, stop);
    let first = run(settings(REFERENCE_SEED - 4));
    // By path tracing: what is judged may be biased.
    let most = (first.spp.max(16) * wanted.times).div_ceil(2);
    let [one, other] = [0, 2].map(|i| {
        let part = |spp, seed| {
            let stop = Stop { spp: Some(spp), ..Stop::default() };
            let reference = Settings { stop, method: Some(Method::Path), ..settings(seed) };
            run(Settings { audit: None, ..reference })
        };
        sharpened(part(most, REFERENCE_SEED - i), || part(most.div_ceil(FEWER), REFERENCE_SEED - i - 1))
    });
    let (image, noise) = mean(&one, &other);
    let image = Arc::new(image);

    let results: Vec<RenderResult> = (0..wanted.renders)
        .map(|seed| run(Settings { reference: Some(image.clone()), ..settings(seed) }))
        .collect();
    let error = |round: &Round| round.reference.map_or(f64::NAN, |against| against.linear.relmse) - noise;
    // The first estimate of each render from so many samples on, and those at the end.
    for octave in 4..12 {
        let from = 1 << octave;
        let rounds = results.iter().filter_map(|result| {
            let known = |round: &&Round| round.error.is_some() && (from..2 * from).contains(&round.spp);
            result.history.iter().find(known)
        });
        row(
            &name,
            &format!("{from}+"),
            rounds.filter_map(|round| Some((error(round), round.error?))).collect(),
        );
    }
    let last = || results.iter().filter_map(|result| result.history.last());
    row(&name, "at the end", last().filter_map(|round| Some((error(round), round.error?))).collect());

    if stop.error.is_none() {
        return;
    }
    let mut ratios: Vec<f64> = last().map(|round| error(round) / wanted.error).collect();
    let near = ratios.iter().filter(|ratio| (1.0 / 1.5..=1.5).contains(*ratio)).count();
    let above = ratios.iter().filter(|ratio| **ratio > 1.0).count();
    let late = results.iter().filter(|result| result.spp >= wanted.spp).count();
    let mut samples: Vec<f64> = results.iter().map(|result| f64::from(result.spp)).collect();
    let mut seconds: Vec<f64> = results.iter().map(|result| result.seconds.render).collect();
    println!(
        "  {name}, {size} x {size}, stopped at {wanted}: error / wanted {:.2}, {:.2}, {:.2}; within a \
         factor of 1.5 in {near} of {renders}, above in {above}; {} samples, {:.2} s (medians), not reached \
         by {most} in {late}; reference of {} samples, relMSE {noise:.1e}",
        quantile(&mut ratios, 0.03),
        quantile(&mut ratios, 0.5),
        quantile(&mut ratios, 0.97),
        quantile(&mut samples, 0.5),
        quantile(&mut seconds, 0.5),
        2 * most,
        size = wanted.size,
        wanted = wanted.error,
        renders = wanted.renders,
        most = wanted.spp,
    );
}

/// The blur of photons falls with the third root of the samples: a picture of fewer samples is blurred three
/// times as much, and half of the difference to it is taken off (docs/validation.md, the slope of progressive
/// photon mapping). Its noise is nine times as large for that: 2.25 of its own, and a quarter of 27 times as
/// much. Not where no blur is found, which is less than that.
fn sharpened(many: RenderResult, few: impl FnOnce() -> RenderResult) -> Image {
    let mut image = many.image;
    if many.noise_and_blur.is_some_and(|noise_and_blur| noise_and_blur.blur.is_significant()) {
        let few = few();
        assert!(few.noise_and_blur.is_some(), "a reference of fewer samples has photons as well");
        for (value, blurred) in
            image.pixels.as_flattened_mut().iter_mut().zip(few.image.pixels.as_flattened())
        {
            *value = 1.5 * *value - 0.5 * blurred;
        }
    }
    image
}

/// The mean of two pictures that know nothing of each other, and its relMSE, which is that of either to it.
fn mean(one: &Image, other: &Image) -> (Image, f64) {
    let mut mean = one.clone();
    for (value, other) in mean.pixels.as_flattened_mut().iter_mut().zip(other.pixels.as_flattened()) {
        *value = 0.5 * (*value + other);
    }
    let noise = relmse(one.colours(), mean.colours());
    (mean, noise)
}

fn settings(wanted: &Wanted, seed: u32, stop: Stop) -> Settings {
    let Wanted { size, method, audit, .. } = *wanted;
    Settings { width: size, height: size, seed, stop, method, audit, ..raw() }
}

/// One line of the table: true errors and their estimates.
fn row(name: &str, samples: &str, known: Vec<(f64, ErrorEstimate)>) {
    if known.len() < 8 {
        return;
    }
    let mut errors: Vec<f64> = known.iter().map(|(error, _)| *error).collect();
    let mut ratios: Vec<f64> = known.iter().map(|(error, estimate)| estimate.relmse / error).collect();
    let mut ends: Vec<f64> = known.iter().map(|(_, estimate)| estimate.upper / estimate.relmse).collect();
    let below = known.iter().filter(|(error, estimate)| *error < estimate.lower).count();
    let above = known.iter().filter(|(error, estimate)| *error > estimate.upper).count();
    println!(
        "| {name} | {samples} | {:.2e} | {:.2}, {:.2}, {:.2} | {:.2} | {} of {} | {below}, {above} |",
        quantile(&mut errors, 0.5),
        quantile(&mut ratios, 0.03),
        quantile(&mut ratios, 0.5),
        quantile(&mut ratios, 0.97),
        quantile(&mut ends, 0.5),
        known.len() - below - above,
        known.len(),
    );
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}
