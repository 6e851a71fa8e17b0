//! `halflight study`: experiments that tell how good the parts of a method are, each by one command.

use super::failure::Failure;
use super::method::Choice;
use super::shot::{self, Options, Shot};
use super::{say, values, warn};
use clap::{Args, Subcommand};
use halflight::drive::{IrradianceStudy, MetricError, Stop, study_irradiance};
use halflight::load;
use halflight_core::cache::irradiance::Metric;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Compare the parts of a method on a scene
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(super) struct Study {
    #[command(subcommand)]
    subject: Subject,
}

#[derive(Subcommand)]
enum Subject {
    Irradiance(Box<Irradiance>),
}

/// The error metrics of the irradiance cache with the same number of records
///
/// For each metric the error is searched that fills the cache of the picture with so many records, to 2 %; what the cache
/// says of the indirect irradiance is then held against exact values at points of the picture.
#[derive(Args)]
struct Irradiance {
    /// The scene: a mesh (.obj) or a scene file (.toml)
    scene: PathBuf,
    /// Records of each metric
    #[arg(long, value_name = "N", default_value = "1700", value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    records: u64,
    /// The metrics [default: all]
    #[arg(long, value_name = "METRIC,...", value_delimiter = ',', value_parser = values::metric)]
    metrics: Vec<Metric>,
    /// Points at which the irradiance is compared, about
    #[arg(long, value_name = "N", default_value = "2000", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    points: u32,
    /// Fill caches progressively: first with four times the radii, then with twice, then with what the error allows
    #[arg(long)]
    progressive: bool,
    #[command(flatten)]
    shot: Shot,
    #[command(flatten)]
    options: Options,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

impl Study {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let Subject::Irradiance(study) = &self.subject;
        study.run()
    }
}

impl Irradiance {
    fn run(&self) -> Result<ExitCode, Failure> {
        let loaded = load::load(&self.scene, &self.shot.load_options(None))?;
        loaded.repairs.iter().for_each(warn);
        let settings = self.shot.settings(&loaded, Choice(None), &self.options, Stop::default(), None)?;
        let views = loaded.views();
        let scene = views.scene(self.shot.view.camera(&loaded)?);
        let metrics = if self.metrics.is_empty() { Metric::ALL.to_vec() } else { self.metrics.clone() };
        let Self { records, points, progressive, .. } = *self;
        let study = IrradianceStudy { metrics, records, points, progressive };
        let mut said = if self.json { Ok(()) } else { say(HEAD) };
        let mut rows = Vec::new();
        study_irradiance(&scene, &settings, &study, &mut |row| {
            if !self.json && said.is_ok() {
                said = say(&text(row));
            }
            rows.push(object(row));
        })
        .map_err(|error| shot::explain(&self.scene, &error))?;
        if self.json {
            let rays = settings.cache.strata().pow(2);
            said = say(
                &json!({ "records": self.records, "rays_per_record": rays, "metrics": rows }).to_string()
            );
        }
        said?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Above the rows.
const HEAD: &str =
    "metric                    error   records       RMSE     noise  1 in 100  reached  predicted   achieved";

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
