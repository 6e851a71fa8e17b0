//! `halflight bench knn`: photon searches per second.

use super::super::failure::Failure;
use super::Common;
use clap::Args;
use core::num::NonZero;
use halflight::bench::REPETITIONS;
use halflight::bench::knn::{self, KnnReport, Speed, WorkSize};
use serde_json::{Map, Value, json};
use std::process::ExitCode;

const PHOTONS: NonZero<usize> = NonZero::new(WorkSize::FULL.photons).unwrap();
const QUERIES: NonZero<usize> = NonZero::new(WorkSize::FULL.queries).unwrap();

/// Photon searches per second on one thread
///
/// The photons lie on the surfaces of a room, three tenths of them in a caustic. The tasks are the 8, 50, 100
/// and 200 nearest photons of surface points, with and without a radius, and density estimates.
#[derive(Args)]
pub(super) struct Knn {
    /// Photons in the map
    #[arg(long, value_name = "N", default_value_t = PHOTONS)]
    photons: NonZero<usize>,
    /// Nearest-photon searches; density estimates are a tenth of them
    #[arg(long, value_name = "N", default_value_t = QUERIES)]
    queries: NonZero<usize>,
    #[command(flatten)]
    common: Common,
}

impl Knn {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let size = WorkSize { photons: self.photons.get(), queries: self.queries.get() };
        let report = knn::run(size, self.common.level())?;
        self.common.print(object(&report), &lines(&report))
    }
}

/// Object of `--json`.
fn object(report: &KnnReport) -> Value {
    let by_task = |speeds: &[Speed], value: fn(&Speed) -> f64| -> Value {
        speeds.iter().map(|speed| (speed.task.name(), value(speed).into())).collect::<Map<_, _>>().into()
    };
    let per_second = |speed: &Speed| speed.queries_per_second;
    json!({
        "level": report.level.name(),
        "build_seconds": report.build_seconds,
        "build_seconds_on_two_threads": report.build_seconds_on_two,
        "bytes_per_photon": report.bytes_per_photon(),
        "queries_per_second": by_task(&report.single, per_second),
        "queries_per_second_in_batches": by_task(&report.batched, per_second),
        "found": by_task(&report.single, |speed| speed.photons),
        "photons": report.size.photons,
        "queries": report.size.queries,
        "repetitions": REPETITIONS,
    })
}

fn lines(report: &KnnReport) -> Vec<String> {
    let (WorkSize { photons, queries }, level) = (report.size, report.level.name());
    let mut lines = vec![
        format!(
            "{photons} photons, {queries} queries, one thread, {level}; medians of {REPETITIONS}, \
             thousands of queries per second"
        ),
        format!(
            "build {:.3} s, {:.3} s on two threads, {:.1} bytes per photon",
            report.build_seconds,
            report.build_seconds_on_two,
            report.bytes_per_photon()
        ),
        format!("{:<14}{:>9}{:>9}{:>9}", "", "found", "single", "batches"),
    ];
    lines.extend(report.single.iter().zip(&report.batched).map(|(single, batched)| {
        let [a, b] = [single, batched].map(|speed| 1e-3 * speed.queries_per_second);
        format!("{:<14}{:>9.1}{a:>9.1}{b:>9.1}", single.task.name(), single.photons)
    }));
    lines
}
