//! `halflight bench rays`: rays per second.

use super::super::camera_args::CameraArgs;
use super::super::failure::Failure;
use super::super::stdio::print_note;
use super::super::values;
use super::Common;
use clap::Args;
use halflight::bench::REPETITIONS;
use halflight::bench::rays::{self, ClassReport, RaysReport, SIZE};
use halflight::load::{self, LoadOptions};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Rays per second on one thread
///
/// Camera rays in tiles, one cosine-distributed ray from each hit, and shadow rays: the same rays, at most a
/// quarter of the scene's diagonal long.
#[derive(Args)]
pub(super) struct Rays {
    /// Scene: a mesh (.obj) or a scene file (.toml)
    scene: PathBuf,
    /// Size of the picture, with one camera ray per pixel [default: 1024x1024]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    size: Option<[u32; 2]>,
    #[command(flatten)]
    camera: CameraArgs,
    #[command(flatten)]
    common: Common,
}

impl Rays {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let loaded = load::load(&self.scene, &LoadOptions { textures: false, ..LoadOptions::default() })?;
        loaded.repairs.iter().for_each(print_note);
        let views = loaded.views();
        let scene = views.scene(self.camera.camera(&loaded)?);
        let report = rays::run(&scene, self.common.level(), self.size.unwrap_or(SIZE))?;
        self.common.print(object(&report), &lines(&report))
    }
}

/// Object of `--json`. Speeds without rays are `null`.
fn object(report: &RaysReport) -> Value {
    let by_class = |value: fn(&ClassReport) -> Value| -> Value {
        report
            .classes
            .iter()
            .map(|class| (class.class.name().into(), value(class)))
            .collect::<Map<_, _>>()
            .into()
    };
    json!({
        "level": report.level.name(),
        "width": report.size[0],
        "height": report.size[1],
        "build_seconds": report.build_seconds,
        "bytes_per_triangle": report.bytes_per_triangle(),
        "mrays_per_second": by_class(|class| class.mrays_per_second.into()),
        "triangles": report.triangles,
        "repetitions": REPETITIONS,
        "rays": by_class(|class| class.rays.into()),
        "hits": by_class(|class| class.hits.into()),
    })
}

fn lines(report: &RaysReport) -> Vec<String> {
    let [width, height] = report.size;
    let row = |name: &str, cell: fn(&ClassReport) -> String| {
        let cells = report.classes.iter().map(|class| format!("{:>10}", cell(class)));
        format!("{name:<14}{}", cells.collect::<String>())
    };
    let (triangles, level) = (report.triangles, report.level.name());
    vec![
        format!(
            "{triangles} triangles, one thread, {level}; medians of {REPETITIONS}, Mray/s; \
             {width}x{height} camera rays"
        ),
        row("", |class| class.class.name().into()) + "      build",
        row("halflight", |class| format!("{:.2}", class.mrays_per_second))
            + &format!("{:>9.3} s{:>8.1} bytes/triangle", report.build_seconds, report.bytes_per_triangle()),
        row("hits", |class| format!("{:.1} %", 100.0 * class.hits as f64 / class.rays.max(1) as f64)),
    ]
}
