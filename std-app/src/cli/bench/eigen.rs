//! `halflight bench eigen`: eigen decompositions per second.

use super::super::failure::Failure;
use super::super::{say, values};
use clap::Args;
use halflight::bench::REPETITIONS;
use halflight::bench::eigen::{self, BATCH, EigenReport, Speeds};
use halflight_simd::{Level, Tier};
use serde_json::{Value, json};
use std::process::ExitCode;

/// Eigen decompositions of small symmetric matrices per second on one thread
///
/// 2×2, as the radii of irradiance records want them, and 3×3: values and vectors of random matrices in batches that
/// stay in the first-level cache.
#[derive(Args)]
pub(super) struct Eigen {
    /// Highest instruction set to use: baseline, avx2 or avx512 [default: the processor's]
    #[arg(long, value_name = "LEVEL", value_parser = values::tier, help_heading = "How to run")]
    simd: Option<Tier>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

impl Eigen {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let level = Level::detect();
        let report = eigen::run(self.simd.map_or(level, |tier| level.capped(tier)));
        say(&if self.json { object(&report).to_string() } else { text(&report) })?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The object of `--json`.
fn object(report: &EigenReport) -> Value {
    let speeds = |speeds: &Speeds| json!({"sym2": speeds.sym2, "sym3": speeds.sym3});
    json!({
        "level": report.level.name(),
        "matrices_per_second": speeds(&report.ours),
        "batch": BATCH,
        "repetitions": REPETITIONS,
    })
}

/// The lines for a person.
fn text(report: &EigenReport) -> String {
    let row = |name: &str, speeds: &Speeds| {
        format!("{name:<14}{:>10.1}{:>10.1}", 1e-6 * speeds.sym2, 1e-6 * speeds.sym3)
    };
    let lines = [
        format!(
            "symmetric matrices in batches of {BATCH}, one thread, {}; medians of {REPETITIONS}, M/s",
            report.level.name()
        ),
        format!("{:<14}{:>10}{:>10}", "", "2x2", "3x3"),
        row("halflight", &report.ours),
    ];
    lines.join("\n")
}
