//! Bias of radiance caching in rooms that are hard for it, with floors of several lobes. Prints a table: the
//! mean over that of path tracing with its standard error, and the worst block of 4 × 4 pixels.
//!
//! `cargo run --profile quick -p halflight-tests --example lobe_rooms -- [--replicas 8] [--path-spp 1024]
//! [--spp 32] [--references DIR] [ROOM… FLOOR…]`. References are kept in DIR.

use halflight::render::Method;
use halflight_core::scene::Surface;
use halflight_tests::render::{blocks_of, number, render};
use halflight_tests::rooms::{boxes_in_black, needles, sheet, spot, with_floor};
use halflight_tests::scenes::{SceneBuffers, metal, table_in_the_sun, varnish};
use std::path::PathBuf;

const SIZE: u32 = 48;
const BLOCK: u32 = 4;

type Room = (&'static str, fn(Surface) -> SceneBuffers);
const ROOMS: [Room; 5] = [
    ("needles", |floor| with_floor(needles(), floor)),
    ("sheet", |floor| with_floor(sheet(), floor)),
    ("black", |floor| with_floor(boxes_in_black(), floor)),
    ("spot", |floor| with_floor(spot(), floor)),
    ("table", table_in_the_sun),
];

/// Block means of each picture, the mean of the picture last.
type Pictures = Vec<Vec<f64>>;

struct Wanted {
    replicas: u32,
    path_spp: u32,
    spp: u32,
    references: Option<PathBuf>,
    names: Vec<String>,
}

fn main() {
    let mut wanted = Wanted { replicas: 8, path_spp: 1024, spp: 32, references: None, names: Vec::new() };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().expect("a value after the flag");
        match argument.as_str() {
            "--replicas" => wanted.replicas = value().parse().expect("a number of pictures"),
            "--path-spp" => wanted.path_spp = value().parse().expect("a number of samples"),
            "--spp" => wanted.spp = value().parse().expect("a number of samples"),
            "--references" => wanted.references = Some(value().into()),
            name => wanted.names.push(name.to_owned()),
        }
    }
    let floors = [
        ("metal-.3", metal(0.3f32.sqrt())),
        ("metal-.1", metal(0.1f32.sqrt())),
        ("varnish-.1", varnish(0.1f32.sqrt())),
    ];
    println!("| room | floor | mean | ± | worst block | ± | records | lobes | views | path s | s |");
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for (room, build) in ROOMS {
        for (floor, surface) in &floors {
            let names = |all: &[&str]| {
                let mut of_kind = wanted.names.iter().filter(|name| all.contains(&name.as_str())).peekable();
                of_kind.peek().is_none() || of_kind.any(|name| name == room || name == floor)
            };
            let all_rooms = ROOMS.map(|(room, _)| room);
            let all_floors = floors.each_ref().map(|(floor, _)| *floor);
            if names(&all_rooms) && names(&all_floors) {
                compare(&wanted, (room, floor), &build(*surface));
            }
        }
    }
}

fn compare(wanted: &Wanted, (room, floor): (&str, &str), buffers: &SceneBuffers) {
    let (path, path_seconds) = reference(wanted, &format!("{room}{floor}"), buffers);
    let mut counts = [0.0; 3];
    let (found, seconds) = pictures(buffers, Method::RadianceCache, wanted.replicas, wanted.spp, &mut counts);
    let last = path[0].len() - 1;
    let [of_path, of_found] =
        [&path, &found].map(|lot| (0..=last).map(|i| moments(lot, i)).collect::<Vec<_>>());
    let light = of_path[last].0;
    let excess = |i: usize| {
        let ((a, va), (b, vb)) = (of_found[i], of_path[i]);
        let unit = b + 0.1 * light;
        ((a - b) / unit, (va + vb).sqrt() / unit)
    };
    let beyond = |i: usize| excess(i).0.abs() - 4.0 * excess(i).1;
    let worst = (0..last).max_by(|&a, &b| beyond(a).total_cmp(&beyond(b))).unwrap_or(0);
    let (mean, variance) = of_found[last];
    let ratio = mean / light;
    let error = ratio * (variance / (mean * mean) + of_path[last].1 / (light * light)).sqrt();
    let ((bias, noise), [records, lobes, views]) = (excess(worst), counts);
    println!(
        "| {room} | {floor} | {ratio:.4} | {error:.4} | {bias:.3} ({}, {}) | {noise:.3} | {records:.0} | \
         {lobes:.0} | {views:.0} | {path_seconds:.1} | {seconds:.1} |",
        worst as u32 % (SIZE / BLOCK) * BLOCK,
        worst as u32 / (SIZE / BLOCK) * BLOCK,
    );
}

fn reference(wanted: &Wanted, name: &str, buffers: &SceneBuffers) -> (Pictures, f64) {
    let file = wanted.references.as_ref().map(|directory| directory.join(name));
    if let Some(text) = file.as_ref().and_then(|file| std::fs::read_to_string(file).ok()) {
        let line = |line: &str| line.split(' ').map(|value| value.parse().expect("a number")).collect();
        return (text.lines().map(line).collect(), 0.0);
    }
    let (path, seconds) = pictures(buffers, Method::Path, wanted.replicas, wanted.path_spp, &mut [0.0; 3]);
    if let Some(file) = file {
        let line = |one: &Vec<f64>| one.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        std::fs::write(file, path.iter().map(line).collect::<Vec<_>>().join("\n")).expect("a file");
    }
    (path, seconds)
}

/// Pictures of different seeds, and the seconds that they took.
fn pictures(
    buffers: &SceneBuffers,
    method: Method,
    replicas: u32,
    spp: u32,
    counts: &mut [f64; 3],
) -> (Pictures, f64) {
    let start = std::time::Instant::now();
    let one = |seed| {
        let result = render(&buffers.scene(), method, SIZE, spp, |settings| {
            (settings.seed, settings.threads) = (seed, Some(1));
            if method == Method::Path {
                settings.caustics = false;
            }
        });
        if method != Method::Path {
            let topics = ["irradiance_cache", "radiance_records", "view_bound_records"];
            *counts = topics.map(|topic| number(&result, topic, "records"));
        }
        let mut values = blocks_of(&result.image, BLOCK);
        values.push(values.iter().sum::<f64>() / values.len() as f64);
        values
    };
    ((0..replicas).map(one).collect(), start.elapsed().as_secs_f64())
}

/// Mean of value `i`, and the variance of that mean.
fn moments(pictures: &Pictures, i: usize) -> (f64, f64) {
    let count = pictures.len() as f64;
    let mean = pictures.iter().map(|p| p[i]).sum::<f64>() / count;
    let squares = pictures.iter().map(|p| (p[i] - mean).powi(2)).sum::<f64>();
    (mean, squares / (count * (count - 1.0)))
}
