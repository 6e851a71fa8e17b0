//! Sharing of paths between pixels: its gain, and whether its error looks like that of independent pixels.
//! Prints for each scene and number of samples, with pictures of many seeds:
//!
//! - the relMSE without and with sharing, and the gain 1 / (relMSE · processor seconds) of the latter over
//!   the former;
//! - within blocks of 8 × 8 smooth pixels, the variance of the means of the four sublattices of pixels with
//!   the same (x mod 2, y mod 2), and of the sixteen with the same (x mod 4, y mod 4), over that of
//!   independent pixels: 1 for those.
//!
//! `cargo run --release -p halflight-tests --example lattice -- [--renders 8] [--size 128] [--spp 16,64]
//! SCENE…`, scene files. Processor seconds are read from /proc, with one thread for each render.

use core::sync::atomic::AtomicBool;
use halflight::load::{self, LoadOptions};
use halflight::render::{Progress, Settings, Stop, render};
use halflight_tests::render::raw;
use std::path::Path;

/// Pixels along a block.
const BLOCK: usize = 8;

/// Blocks count as smooth where the mean of all pictures scatters by less than this share of itself.
const SMOOTH: f64 = 0.1;

struct Kind {
    pictures: Vec<Vec<f64>>,
    seconds: f64,
}

fn main() {
    let (mut renders, mut size, mut spp) = (8, 128, vec![16, 64]);
    let mut scenes = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().expect("a value after the flag");
        match argument.as_str() {
            "--renders" => renders = value().parse().expect("a number"),
            "--size" => size = value().parse().expect("a number"),
            "--spp" => spp = value().split(',').map(|n| n.parse().expect("numbers")).collect(),
            _ => scenes.push(argument),
        }
    }
    println!("| scene | spp | relMSE alone | shared | seconds | gain | 2 x 2 | 4 x 4 | blocks |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for scene in scenes {
        let file = Path::new(&scene);
        let loaded = load::load(file, &LoadOptions::default()).expect("a scene");
        let views = loaded.views();
        let scene = views.scene(loaded.camera_or_default());
        for spp in &spp {
            let kind = |reuse| {
                let mut kind = Kind { pictures: Vec::new(), seconds: 0.0 };
                for seed in 0..renders {
                    let settings = Settings {
                        width: size,
                        height: size,
                        seed,
                        stop: Stop { spp: Some(*spp), ..Stop::default() },
                        threads: Some(1),
                        reuse: Some(reuse),
                        caustics: false,
                        ..raw()
                    };
                    // Of rendering alone, from the first sample on.
                    let mut before = None;
                    let mut begin = |_: &Progress| {
                        before.get_or_insert_with(processor_seconds);
                    };
                    let result = render(&scene, &settings, &mut begin, &AtomicBool::new(false));
                    let result = result.expect("enough memory");
                    kind.seconds += (processor_seconds() - before.unwrap_or_default()) / f64::from(renders);
                    let pixels = result.image.pixels.iter();
                    kind.pictures.push(pixels.map(|[r, g, b]| f64::from((r + g + b) / 3.0)).collect());
                }
                kind
            };
            let [alone, shared] = [false, true].map(kind);
            let [before, after] = [&alone, &shared].map(|kind| relmse(&kind.pictures));
            let (cost, size) = (shared.seconds / alone.seconds, size as usize);
            let (two, count) = scatter(&shared.pictures, size, 2);
            let (four, _) = scatter(&shared.pictures, size, 4);
            println!(
                "| {} | {spp} | {before:.3e} | {after:.3e} | {cost:.2} | {:.2} | {two:.2} | {four:.2} | {count} |",
                file.file_stem().unwrap_or_default().to_string_lossy(),
                before / after / cost,
            );
        }
    }
}

fn mean_of(pictures: &[Vec<f64>]) -> Vec<f64> {
    let mut mean = vec![0.0; pictures[0].len()];
    for picture in pictures {
        mean.iter_mut().zip(picture).for_each(|(mean, value)| *mean += value / pictures.len() as f64);
    }
    mean
}

/// The relMSE of one picture from the variance between pictures.
fn relmse(pictures: &[Vec<f64>]) -> f64 {
    let mean = mean_of(pictures);
    let all = mean.iter().sum::<f64>() / mean.len() as f64;
    let squares = pictures.iter().flat_map(|picture| {
        picture
            .iter()
            .zip(&mean)
            .map(|(value, mean)| (value - mean).powi(2) / (mean * mean + 0.01 * all * all))
    });
    squares.sum::<f64>() / ((pictures.len() - 1) * mean.len()) as f64
}

/// The variance between the means of the `side`² sublattices of smooth blocks, over that of as many
/// independent pixels; and how many blocks there are.
fn scatter(pictures: &[Vec<f64>], width: usize, side: usize) -> (f64, usize) {
    let mean = mean_of(pictures);
    let (mut ratios, mut count) = (0.0, 0);
    let parts = side * side;
    for corner in (0..width / BLOCK * width / BLOCK).map(|i| {
        let across = width / BLOCK;
        i / across * BLOCK * width + i % across * BLOCK
    }) {
        let places = || (0..BLOCK * BLOCK).map(move |i| (corner + i / BLOCK * width + i % BLOCK, i));
        let values: Vec<f64> = places().map(|(place, _)| mean[place]).collect();
        let level = values.iter().sum::<f64>() / values.len() as f64;
        let variance = |values: &[f64]| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64
        };
        if !(level > 0.0 && variance(&values).sqrt() < SMOOTH * level) {
            continue;
        }
        let (mut between, mut pixels) = (0.0, 0.0);
        for picture in pictures {
            let mut sums = vec![0.0; parts];
            let mut errors = Vec::new();
            for (place, i) in places() {
                let error = picture[place] - mean[place];
                sums[i / BLOCK % side * side + i % BLOCK % side] += error;
                errors.push(error);
            }
            let of_each = (BLOCK * BLOCK / parts) as f64;
            sums.iter_mut().for_each(|sum| *sum /= of_each);
            between += variance(&sums);
            pixels += errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64 / of_each;
        }
        if pixels > 0.0 {
            ratios += between / pixels;
            count += 1;
        }
    }
    (ratios / f64::max(f64::from(count), 1.0), count as usize)
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
