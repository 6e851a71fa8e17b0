//! `halflight bench knn`: searches of the photon map.

use super::super::failure::Failure;
use super::super::{say, values};
use clap::Args;
use core::num::NonZero;
use halflight::bench::REPETITIONS;
use halflight::bench::knn::{self, Amount, KnnReport, Speed};
use halflight_simd::{Level, Tier};
use serde_json::{Map, Value, json};
use std::process::ExitCode;

/// What is measured where nothing else is asked for.
const PHOTONS: NonZero<usize> = NonZero::new(Amount::FULL.photons).unwrap();
const QUERIES: NonZero<usize> = NonZero::new(Amount::FULL.queries).unwrap();

/// Searches of the photon map per second, on one thread
///
/// A million photons on the surfaces of a room, three tenths of them in the focus of a caustic; the 8, 50, 100 and
/// 200 nearest of places on the surfaces, with and without a radius, and the density estimate.
#[derive(Args)]
pub(super) struct Knn {
    /// Photons in the map
    #[arg(long, value_name = "N", default_value_t = PHOTONS, help_heading = "What to measure")]
    photons: NonZero<usize>,
    /// Searches for the nearest photons; of density estimates a tenth of them
    #[arg(long, value_name = "N", default_value_t = QUERIES, help_heading = "What to measure")]
    queries: NonZero<usize>,
    /// Highest instruction set to use: baseline, avx2 or avx512 [default: the processor's]
    #[arg(long, value_name = "LEVEL", value_parser = values::tier, help_heading = "How to run")]
    simd: Option<Tier>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

impl Knn {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let level = Level::detect();
        let level = self.simd.map_or(level, |tier| level.capped(tier));
        let report = knn::run(Amount { photons: self.photons.get(), queries: self.queries.get() }, level)?;
        say(&if self.json { object(&report).to_string() } else { text(&report) })?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The object of `--json`.
fn object(report: &KnnReport) -> Value {
    let by_task = |speeds: &[Speed], value: fn(&Speed) -> f64| -> Value {
        speeds.iter().map(|speed| (speed.task.name(), value(speed).into())).collect::<Map<_, _>>().into()
    };
    let speed = |speed: &Speed| speed.queries_per_second;
    let found = |speed: &Speed| speed.found;
    json!({
        "level": report.level.name(),
        "build_seconds": report.build_seconds,
        "build_seconds_on_two_threads": report.build_seconds_on_two,
        "bytes_per_photon": report.bytes_per_photon(),
        "queries_per_second": by_task(&report.singly, speed),
        "queries_per_second_in_batches": by_task(&report.together, speed),
        "found": by_task(&report.singly, found),
        "photons": report.amount.photons,
        "queries": report.amount.queries,
        "repetitions": REPETITIONS,
    })
}

/// The lines for a person.
fn text(report: &KnnReport) -> String {
    let mut lines = vec![
        format!(
            "{} photons, {} queries, one thread, {}; medians of {REPETITIONS}, thousands of queries a second",
            report.amount.photons,
            report.amount.queries,
            report.level.name()
        ),
        format!(
            "build {:.3} s, {:.3} s on two threads, {:.1} bytes a photon",
            report.build_seconds,
            report.build_seconds_on_two,
            report.bytes_per_photon()
        ),
    ];
    lines.push(format!("{:<14}{:>9}{:>9}{:>9}", "", "found", "singly", "batches"));
    for (one, all) in report.singly.iter().zip(&report.together) {
        let thousands = |speed: &Speed| format!("{:>9.1}", 1e-3 * speed.queries_per_second);
        lines.push(format!("{:<14}{:>9.1}{}{}", one.task.name(), one.found, thousands(one), thousands(all)));
    }
    lines.join("\n")
}
