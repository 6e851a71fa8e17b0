//! Does the interval hold the error, and does a render that stops by its error have it? Renders scenes with many
//! seeds, counts in how many renders the estimated interval of 95 % holds the error against a reference of 100 times
//! the samples, and by which factor renders miss the error that they were asked for. Prints the tables of
//! docs/validation.md: `cargo run --release -p halflight-tests --example calibration [RENDERS [SCENE…]]`, of our own
//! scenes by name or of any scene file.

use core::sync::atomic::AtomicBool;
use halflight::drive::{RenderResult, Settings, Stop, render};
use halflight::load::{self, LoadOptions};
use halflight::save::Image;
use halflight_core::estimate::Difference;
use halflight_core::scene::Scene;
use std::path::{Path, PathBuf};

/// Pixels across and down: 16 tiles.
const SIZE: u32 = 64;

/// Samples of each pixel.
const SAMPLES: [u32; 2] = [16, 64];

/// The error to stop at, and the most samples for it.
const WANTED: f64 = 0.01;
const MOST: u32 = 2048;

/// A reference has this many times the samples.
const REFERENCE: u32 = 100;

/// Seeds of renders count from 0.
const REFERENCE_SEED: u32 = u32::MAX;

const SCENES: [&str; 4] = ["cornell.obj", "glossy.toml", "two-rooms.toml", "caustic.toml"];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let renders: u32 = arguments.next().map_or(100, |count| count.parse().expect("a number of renders"));
    let chosen: Vec<String> = arguments.collect();
    println!(
        "| scene | samples | relMSE, median | estimate / error: 3 %, median, 97 % | interval / estimate, median | held |"
    );
    println!("|---|---|---|---|---|---|");
    for scene in SCENES.iter().filter(|name| chosen.is_empty() || chosen.iter().any(|c| name.contains(&**c)))
    {
        calibrate(&find(scene), renders);
    }
    for scene in chosen.iter().map(Path::new).filter(|path| path.exists()) {
        calibrate(scene, renders);
    }
}

fn find(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let stem = name.split('.').next().unwrap_or(name);
    folder.join(stem).join(name)
}

fn calibrate(file: &Path, renders: u32) {
    let loaded = load::load(file, &LoadOptions::default()).expect("a scene of our own");
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    let most = SAMPLES.into_iter().max().unwrap_or(1);
    let reference = picture(&scene, REFERENCE * most, REFERENCE_SEED).image;
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    for samples in SAMPLES {
        let (mut errors, mut ratios, mut widths, mut held) = (Vec::new(), Vec::new(), Vec::new(), 0);
        for seed in 0..renders {
            let result = picture(&scene, samples, seed);
            let error = error_of(&result, &reference);
            let estimate = result.error.expect("the scene is lit");
            held += u32::from((estimate.lower..=estimate.upper).contains(&error));
            errors.push(error);
            ratios.push(estimate.relmse / error);
            widths.push((estimate.upper - estimate.lower) / estimate.relmse);
        }
        let [low, middle, high] = [0.03, 0.5, 0.97].map(|share| quantile(&mut ratios, share));
        println!(
            "| {} | {samples} | {:.2e} | {low:.2}, {middle:.2}, {high:.2} | {:.2} | {held} of {renders} |",
            name,
            quantile(&mut errors, 0.5),
            quantile(&mut widths, 0.5),
        );
    }

    let (mut ratios, mut samples, mut near, mut late) = (Vec::new(), Vec::new(), 0, 0);
    for seed in 0..renders {
        let stop = Stop { error: Some(WANTED), spp: Some(MOST), ..Stop::default() };
        let result = stopped(&scene, stop, seed);
        let ratio = error_of(&result, &reference) / WANTED;
        near += u32::from((1.0 / 1.5..=1.5).contains(&ratio));
        late += u32::from(result.spp == MOST);
        ratios.push(ratio);
        samples.push(f64::from(result.spp));
    }
    let [low, middle, high] = [0.03, 0.5, 0.97].map(|share| quantile(&mut ratios, share));
    println!(
        "  {name}, stopped at {WANTED}: error / wanted {low:.2}, {middle:.2}, {high:.2}; within a factor of 1.5 in {near} of \
         {renders}; {} samples (median), not reached by {MOST} in {late}",
        quantile(&mut samples, 0.5)
    );
}

fn error_of(result: &RenderResult, reference: &Image) -> f64 {
    Difference::between(result.image.colours(), reference.colours()).relmse
}

fn picture(scene: &Scene, samples: u32, seed: u32) -> RenderResult {
    stopped(scene, Stop { spp: Some(samples), ..Stop::default() }, seed)
}

fn stopped(scene: &Scene, stop: Stop, seed: u32) -> RenderResult {
    let settings = Settings { width: SIZE, height: SIZE, seed, stop, ..Settings::default() };
    render(scene, &settings, &mut |_| (), &AtomicBool::new(false)).expect("memory for a small picture")
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}
