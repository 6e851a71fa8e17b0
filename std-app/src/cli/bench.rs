//! `halflight bench`: speed of the kernels on this machine.

mod eigen;
mod knn;

use super::failure::Failure;
use super::view::ViewFlags;
use super::{say, values, warn};
use clap::{Args, Subcommand};
use halflight::bench::REPETITIONS;
use halflight::bench::rays::{self, RaysReport, SIZE};
use halflight::load::{self, LoadOptions};
use halflight_simd::{Level, Tier};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Measure the kernels on this machine
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(super) struct Bench {
    #[command(subcommand)]
    kernel: Kernel,
}

#[derive(Subcommand)]
enum Kernel {
    Rays(Box<Rays>),
    Eigen(eigen::Eigen),
    Knn(knn::Knn),
}

/// Rays per second on one thread
///
/// Camera rays of a picture in tiles, one cosine-distributed bounce from each point that they meet,
/// and shadow rays: the same, at most a quarter of the diagonal of the scene long.
#[derive(Args)]
struct Rays {
    /// The scene: a mesh (.obj) or a scene file (.toml)
    scene: PathBuf,
    /// Size of the picture: one camera ray for each pixel [default: 1024x1024]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    size: Option<[u32; 2]>,
    #[command(flatten)]
    view: ViewFlags,
    /// Highest instruction set to use: baseline, avx2 or avx512 [default: the processor's]
    #[arg(long, value_name = "LEVEL", value_parser = values::tier, help_heading = "How to run")]
    simd: Option<Tier>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

impl Bench {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        match &self.kernel {
            Kernel::Rays(rays) => rays.run(),
            Kernel::Eigen(eigen) => eigen.run(),
            Kernel::Knn(knn) => knn.run(),
        }
    }
}

impl Rays {
    fn run(&self) -> Result<ExitCode, Failure> {
        let loaded = load::load(&self.scene, &LoadOptions { textures: false, ..LoadOptions::default() })?;
        for repair in &loaded.repairs {
            warn(repair);
        }
        let views = loaded.views();
        let scene = views.scene(self.view.camera(&loaded)?);
        let level = Level::detect();
        let level = self.simd.map_or(level, |tier| level.capped(tier));
        let report = rays::run(&scene, level, self.size.unwrap_or(SIZE))?;
        say(&if self.json { object(&report).to_string() } else { text(&report) })?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The object of `--json`. Speeds of no rays are `null`.
fn object(report: &RaysReport) -> Value {
    let by_class = |values: Vec<Value>| -> Value {
        let names = report.classes.iter().map(|class| class.class.name().to_string());
        names.zip(values).collect::<Map<_, _>>().into()
    };
    json!({
        "level": report.level.name(),
        "width": report.size[0],
        "height": report.size[1],
        "build_seconds": report.build_seconds,
        "bytes_per_triangle": report.bytes_per_triangle(),
        "mrays_per_second": by_class(report.classes.iter().map(|c| c.mrays_per_second.into()).collect()),
        "triangles": report.triangles,
        "repetitions": REPETITIONS,
        "rays": by_class(report.classes.iter().map(|c| c.rays.into()).collect()),
        "hits": by_class(report.classes.iter().map(|c| c.hits.into()).collect()),
    })
}

/// The lines for a person.
fn text(report: &RaysReport) -> String {
    let [width, height] = report.size;
    let mut lines = vec![
        format!(
            "{} triangles, one thread, {}; medians of {REPETITIONS}, Mray/s; {width}x{height} camera rays",
            report.triangles,
            report.level.name()
        ),
        row("", report.classes.iter().map(|class| class.class.name().to_string())) + "      build",
        row("halflight", report.classes.iter().map(|class| format!("{:.2}", class.mrays_per_second)))
            + &format!("{:>9.3} s{:>8.1} bytes/triangle", report.build_seconds, report.bytes_per_triangle()),
    ];
    let share = |hits: usize, rays: usize| format!("{:.1} %", 100.0 * hits as f64 / rays.max(1) as f64);
    lines.push(row("met something", report.classes.iter().map(|class| share(class.hits, class.rays))));
    lines.join("\n")
}

fn row(name: &str, cells: impl Iterator<Item = String>) -> String {
    cells.fold(format!("{name:<14}"), |line, cell| line + &format!("{cell:>10}"))
}
