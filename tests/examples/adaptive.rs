//! What adaptive sampling gains at equal time: relMSE times processor seconds, without and with it, in turns. Each
//! picture is held against the mean of all others of its scene, of both kinds. Prints the table of docs/validation.md:
//!
//! `cargo run --release -p halflight-tests --example adaptive -- [--renders 16] [--size 128] [--spp 64 | --error 0.001]
//! [--auto] SCENE…`, scene files. With `--auto` the renderer tells whether it pays. With `--error` renders stop by themselves; how many had that error within a factor of 1.5, and how
//! many had more, is printed besides. Processor seconds are read from /proc, with one thread for each render.

use core::sync::atomic::AtomicBool;
use halflight::drive::{Progress, RenderResult, Settings, Stop, render};
use halflight::load::{self, LoadOptions};
use std::path::Path;

/// Renders of one kind: as many values in each as the picture has.
#[derive(Default)]
struct Kind {
    pictures: Vec<Vec<f64>>,
    seconds: Vec<f64>,
    estimates: Vec<f64>,
    held: usize,
    spp: Vec<f64>,
    gains: Vec<f64>,
    errors: Vec<f64>,
}

fn main() {
    let (mut renders, mut size, mut scenes) = (16, 128, Vec::new());
    let mut stop = Stop { spp: Some(64), ..Stop::default() };
    let mut adaptive = Some(true);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || -> f64 {
            arguments.next().and_then(|value| value.parse().ok()).expect("a number after the flag")
        };
        match argument.as_str() {
            "--renders" => renders = value() as u32,
            "--size" => size = value() as u32,
            "--spp" => stop = Stop { spp: Some(value() as u32), ..Stop::default() },
            "--error" => stop = Stop { error: Some(value()), ..Stop::default() },
            "--auto" => adaptive = None,
            _ => scenes.push(argument),
        }
    }
    println!(
        "| scene | relMSE | adaptive / uniform | seconds | gain at equal time | estimate / error | held | mean | tiles |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for scene in scenes {
        measure(Path::new(&scene), renders, size, stop, adaptive);
    }
}

fn measure(file: &Path, renders: u32, size: u32, stop: Stop, adaptive: Option<bool>) {
    let loaded = load::load(file, &LoadOptions::default()).expect("a scene");
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    let mut kinds = [Kind::default(), Kind::default()];
    let mut intervals = [Vec::new(), Vec::new()];
    for seed in 0..renders {
        for (index, kind) in kinds.iter_mut().enumerate() {
            let settings = Settings {
                width: size,
                height: size,
                seed: 2 * seed + index as u32,
                stop,
                adaptive: if index == 1 { adaptive } else { Some(false) },
                threads: Some(1),
                ..Settings::default()
            };
            // Of rendering alone, from the first sample on.
            let mut before = None;
            let mut begin = |_: &Progress| {
                before.get_or_insert_with(processor_seconds);
            };
            let result: RenderResult =
                render(&scene, &settings, &mut begin, &AtomicBool::new(false)).expect("enough memory");
            kind.seconds.push(processor_seconds() - before.unwrap_or_default());
            intervals[index].extend(result.error);
            kind.spp.push(f64::from(result.spp));
            kind.gains.extend(result.adaptive.gain);
            kind.pictures.push(result.image.pixels.iter().flatten().map(|v| f64::from(*v)).collect());
        }
    }

    let all = kinds.iter().map(|kind| kind.pictures.len()).sum::<usize>() as f64;
    let values = kinds[0].pictures[0].len();
    let mut sum = vec![0.0; values];
    for picture in kinds.iter().flat_map(|kind| &kind.pictures) {
        sum.iter_mut().zip(picture).for_each(|(sum, value)| *sum += value);
    }
    let mean = sum.iter().sum::<f64>() / all / values as f64;
    for (kind, intervals) in kinds.iter_mut().zip(&intervals) {
        for (picture, interval) in kind.pictures.iter().zip(intervals) {
            let squares = picture.iter().zip(&sum).map(|(value, sum)| {
                let reference = (sum - value) / (all - 1.0);
                (value - reference).powi(2) / ((sum / all).powi(2) + 0.01 * mean * mean)
            });
            // The others have noise too, of the same size in the mean.
            let error = squares.sum::<f64>() / values as f64 * (all - 1.0) / all;
            kind.estimates.push(interval.relmse / error);
            kind.held += usize::from((interval.lower..=interval.upper).contains(&error));
            kind.errors.push(error);
        }
    }
    let [uniform, adaptive] = &kinds;
    let errors = mean_of(&adaptive.errors) / mean_of(&uniform.errors);
    let seconds = median(&adaptive.seconds) / median(&uniform.seconds);
    let tiles = tiles(&kinds, size as usize);
    let worst = tiles.iter().skip(1).fold(0.0, |worst: f64, t| worst.max(t.abs()));
    println!(
        "| {} | {:.2e} | {errors:.3} ± {:.3} | {seconds:.3} | **{:.3}** | {:.2}, {:.2} | {}, {} of {renders} | {:+.1} | {worst:.1} of {} |",
        file.file_stem().unwrap_or_default().to_string_lossy(),
        mean_of(&uniform.errors),
        errors * spread(&uniform.errors).hypot(spread(&adaptive.errors)),
        1.0 / (errors * seconds),
        median(&uniform.estimates),
        median(&adaptive.estimates),
        uniform.held,
        adaptive.held,
        tiles[0],
        tiles.len() - 1,
    );
    let name = ["uniform", "adaptive"];
    for (kind, name) in kinds.iter().zip(name).filter(|_| stop.error.is_some()) {
        let wanted = stop.error.unwrap_or(f64::NAN);
        let mut ratios: Vec<f64> = kind.errors.iter().map(|error| error / wanted).collect();
        ratios.sort_by(f64::total_cmp);
        let near = ratios.iter().filter(|ratio| (1.0 / 1.5..=1.5).contains(*ratio)).count();
        println!(
            "  {name}: error / wanted {:.2}, {:.2}, {:.2}; within a factor of 1.5 in {near} of {renders}, above in {}; \
             {} samples (median)",
            ratios[0],
            median(&ratios),
            ratios[ratios.len() - 1],
            ratios.iter().filter(|ratio| **ratio > 1.0).count(),
            median(&kind.spp),
        );
    }
    if !adaptive.gains.is_empty() {
        println!("  gain as told: {:.3}", median(&adaptive.gains));
    }
}

/// How far the means of both kinds are apart, in standard errors: of the picture, and of blocks of 16 x 16 pixels.
fn tiles(kinds: &[Kind; 2], size: usize) -> Vec<f64> {
    let across = size.div_ceil(16);
    let parts = kinds.each_ref().map(|kind| {
        let of_picture = |picture: &Vec<f64>| {
            let mut sums = vec![0.0; 1 + across * across];
            for (i, value) in picture.iter().enumerate() {
                let (x, y) = (i / 3 % size, i / 3 / size);
                sums[0] += value;
                sums[1 + y / 16 * across + x / 16] += value;
            }
            sums
        };
        kind.pictures.iter().map(of_picture).collect::<Vec<_>>()
    });
    (0..=across * across)
        .map(|part| {
            let [a, b] = parts.each_ref().map(|pictures| {
                let values: Vec<f64> = pictures.iter().map(|sums| sums[part]).collect();
                (mean_of(&values), mean_of(&values) * spread(&values))
            });
            (b.0 - a.0) / a.1.hypot(b.1).max(f64::MIN_POSITIVE)
        })
        .collect()
}

/// Of all threads of this program, user and system.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("/proc");
    let fields: Vec<f64> = stat
        .rsplit(')')
        .next()
        .expect("a name in brackets")
        .split_whitespace()
        .map(|field| field.parse().unwrap_or(0.0))
        .collect();
    (fields[11] + fields[12]) / 100.0
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Relative standard error of the mean.
fn spread(values: &[f64]) -> f64 {
    let (mean, count) = (mean_of(values), values.len() as f64);
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0) / count).sqrt() / mean
}

fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
