//! `halflight bench eigen`: eigen decompositions per second.

use super::super::failure::Failure;
use super::Common;
use clap::Args;
use halflight::bench::REPETITIONS;
use halflight::bench::eigen::{self, BATCH};
use serde_json::json;
use std::process::ExitCode;

/// Eigen decompositions of small symmetric matrices per second on one thread
///
/// Values and vectors of random 2×2 matrices, as in the radii of irradiance records, and of 3×3 matrices, in
/// batches that fit into the first-level cache.
#[derive(Args)]
pub(super) struct Eigen {
    #[command(flatten)]
    common: Common,
}

impl Eigen {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let report = eigen::run(self.common.level());
        let (level, speeds) = (report.level.name(), report.ours);
        let object = json!({
            "level": level,
            "matrices_per_second": { "sym2": speeds.sym2, "sym3": speeds.sym3 },
            "batch": BATCH,
            "repetitions": REPETITIONS,
        });
        let lines = [
            format!(
                "symmetric matrices in batches of {BATCH}, one thread, {level}; medians of {REPETITIONS}, M/s"
            ),
            format!("{:<14}{:>10}{:>10}", "", "2x2", "3x3"),
            format!("{:<14}{:>10.1}{:>10.1}", "halflight", 1e-6 * speeds.sym2, 1e-6 * speeds.sym3),
        ];
        self.common.print(object, &lines)
    }
}
