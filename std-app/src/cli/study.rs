//! `halflight study`: experiments on parts of a method.

use super::failure::Failure;
use super::picture_args::{MethodArg, MethodArgs, PictureArgs, render_failure};
use super::stdio::{print_note, print_result};
use super::study_radiance::Radiance;
use super::values;
use clap::{Args, Subcommand};
use halflight::load;
use halflight::render::{IrradianceStudy, MetricError, Stop, study_irradiance};
use halflight_core::cache::irradiance::Metric;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Compare variants of a part of a method
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(super) struct Study {
    #[command(subcommand)]
    subject: Subject,
}

#[derive(Subcommand)]
enum Subject {
    Irradiance(Box<Irradiance>),
    Radiance(Radiance),
}

/// Error metrics of the irradiance cache at equal numbers of records
///
/// For each metric the error is searched that fills the cache of the picture with the number of records, to
/// 2 %. The cached irradiance is then compared with many gather rays at points of the picture.
#[derive(Args)]
struct Irradiance {
    /// Scene: a mesh (.obj) or a scene file (.toml)
    scene: PathBuf,
    /// Records per metric
    #[arg(long, value_name = "N", default_value = "1700",
        value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    records: u64,
    /// Metrics to compare [default: all]
    #[arg(long, value_name = "METRIC,...", value_delimiter = ',', value_parser = values::metric)]
    metrics: Vec<Metric>,
    /// Points of comparison, about
    #[arg(long, value_name = "N", default_value = "2000",
        value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    points: u32,
    /// Fill caches first with four times the radii, then with twice, then with those of the error
    #[arg(long)]
    progressive: bool,
    #[command(flatten)]
    picture: PictureArgs,
    #[command(flatten)]
    method_args: MethodArgs,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

impl Study {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        match &self.subject {
            Subject::Irradiance(study) => study.run(),
            Subject::Radiance(study) => study.run(),
        }
    }
}

impl Irradiance {
    fn run(&self) -> Result<ExitCode, Failure> {
        let loaded = load::load(&self.scene, &self.picture.load_options(None))?;
        loaded.repairs.iter().for_each(print_note);
        let settings =
            self.picture.settings(&loaded, MethodArg(None), &self.method_args, Stop::default(), None)?;
        let views = loaded.views();
        let scene = views.scene(self.picture.camera.camera(&loaded)?);
        let metrics = if self.metrics.is_empty() { Metric::ALL.to_vec() } else { self.metrics.clone() };
        let Self { records, points, progressive, .. } = *self;
        let study = IrradianceStudy { metrics, records, points, progressive };
        let mut printed = if self.json { Ok(()) } else { print_result(HEAD) };
        let mut rows = Vec::new();
        study_irradiance(&scene, &settings, &study, &mut |row| {
            if !self.json && printed.is_ok() {
                printed = print_result(&text(row));
            }
            rows.push(object(row));
        })
        .map_err(|error| render_failure(&self.scene, &error))?;
        printed?;
        if self.json {
            let rays = settings.cache.strata().pow(2);
            let object = json!({ "records": records, "rays_per_record": rays, "metrics": rows });
            print_result(&object.to_string())?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Head of the table.
const HEAD: &str =
    "metric                    error   records       RMSE     noise  1 in 100  covered  predicted   achieved";

fn text(row: &MetricError) -> String {
    format!(
        "{:<21} {:>9.2e} {:>9} {:>10.5} {:>9.5} {:>9.4} {:>6.1} % {:>10.5} {:>10.5}",
        row.metric.name(),
        row.error,
        row.records,
        row.rmse,
        row.noise,
        row.worst,
        100.0 * row.reached,
        row.predicted,
        row.achieved,
    )
}

fn object(row: &MetricError) -> Value {
    json!({
        "metric": row.metric.name(),
        "error": row.error,
        "records": row.records,
        "rmse": row.rmse,
        "noise": row.noise,
        "worst": row.worst,
        "reached": row.reached,
        "predicted": row.predicted,
        "achieved": row.achieved,
    })
}
