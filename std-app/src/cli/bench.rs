//! `halflight bench`: speed of the kernels on this machine.

mod eigen;
mod knn;
mod rays;
mod shade;

use super::failure::Failure;
use super::stdio::print_result;
use super::values;
use clap::{Args, Subcommand};
use halflight_simd::{Level, Tier};
use serde_json::Value;
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
    Rays(Box<rays::Rays>),
    Eigen(eigen::Eigen),
    Knn(knn::Knn),
    Shade(shade::Shade),
}

/// Flags of all benchmarks.
#[derive(Args)]
struct Common {
    /// Highest instruction set: baseline, avx2 or avx512 [default: the best of the processor]
    #[arg(long, value_name = "LEVEL", value_parser = values::tier, help_heading = "Execution")]
    simd: Option<Tier>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

impl Common {
    fn level(&self) -> Level {
        let level = Level::detect();
        self.simd.map_or(level, |tier| level.capped(tier))
    }

    fn print(&self, object: Value, lines: &[String]) -> Result<ExitCode, Failure> {
        print_result(&if self.json { object.to_string() } else { lines.join("\n") })?;
        Ok(ExitCode::SUCCESS)
    }
}

impl Bench {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        match &self.kernel {
            Kernel::Rays(rays) => rays.run(),
            Kernel::Eigen(eigen) => eigen.run(),
            Kernel::Knn(knn) => knn.run(),
            Kernel::Shade(shade) => shade.run(),
        }
    }
}
