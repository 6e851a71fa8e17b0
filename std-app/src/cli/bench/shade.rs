//! `halflight bench shade`: nanoseconds per vertex of the shading kernels.

use super::super::failure::Failure;
use super::Common;
use clap::Args;
use halflight::bench::REPETITIONS;
use halflight::bench::shade::{self, BLOCKS, KernelSpeed};
use serde_json::{Map, json};
use std::process::ExitCode;

/// Nanoseconds per vertex of the shading kernels on one thread
///
/// Camera rays, surface points, random numbers, light samples and scattering, by lanes and by their scalar
/// references, in blocks of sixteen vertices.
#[derive(Args)]
pub(super) struct Shade {
    #[command(flatten)]
    common: Common,
}

impl Shade {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let report = shade::run(self.common.level());
        let level = report.level.name();
        let by_name = |speed: fn(&KernelSpeed) -> f64| -> Map<String, serde_json::Value> {
            report.kernels.iter().map(|kernel| (kernel.name.into(), json!(speed(kernel)))).collect()
        };
        let object = json!({
            "level": level,
            "ns_per_vertex": { "scalar": by_name(|k| k.scalar), "lanes": by_name(|k| k.lanes) },
            "blocks": BLOCKS,
            "repetitions": REPETITIONS,
        });
        let mut lines = vec![
            format!(
                "{BLOCKS} blocks of 16 vertices, one thread, {level}; medians of {REPETITIONS}, ns a vertex"
            ),
            format!("{:<26}{:>10}{:>10}{:>10}", "", "scalar", "lanes", "ratio"),
        ];
        lines.extend(report.kernels.iter().map(|KernelSpeed { name, scalar, lanes }| {
            format!("{name:<26}{scalar:>10.2}{lanes:>10.2}{:>10.1}", scalar / lanes)
        }));
        self.common.print(object, &lines)
    }
}
