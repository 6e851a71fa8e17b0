//! Speed of the kernels on one thread of this machine, beside other libraries that the program is built with:
//! each is a cargo feature (`embree`, `kiddo`, `nanoflann`, `nalgebra`). All are timed in turn, repetition by
//! repetition, so that other load of the machine affects them alike; the medians are reported.

mod eigen;
mod knn;
mod rays;
mod shade;

use crate::Result;
use crate::flags::tier;
use crate::output::Output;
use clap::{Args, Subcommand};
use halflight_simd::{Level, Tier};

/// Number of measurements, of which the median is reported.
const REPETITIONS: usize = 7;

/// Measure the kernels on this machine
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct Bench {
    #[command(subcommand)]
    kernel: Kernel,
    /// Highest instruction set: baseline, avx2 or avx512 [default: the best of the processor]
    #[arg(long, value_name = "LEVEL", value_parser = tier, global = true)]
    simd: Option<Tier>,
}

#[derive(Subcommand)]
enum Kernel {
    Rays(Box<rays::Rays>),
    Eigen(eigen::Eigen),
    Knn(knn::Knn),
    Shade(shade::Shade),
}

impl Bench {
    pub(crate) fn run(&self, output: &mut Output) -> Result<()> {
        let level = Level::detect();
        let level = self.simd.map_or(level, |tier| level.capped(tier));
        match &self.kernel {
            Kernel::Rays(rays) => rays.run(level, output),
            Kernel::Eigen(eigen) => eigen.run(level, output),
            Kernel::Knn(knn) => knn.run(level, output),
            Kernel::Shade(shade) => shade.run(level, output),
        }
    }
}

/// One line of a table.
fn row(name: &str, cells: impl IntoIterator<Item = String>) -> String {
    cells.into_iter().fold(format!("{name:<26}"), |line, cell| line + &format!("{cell:>12}"))
}

/// Median of `values`, NaN if empty.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = |i: usize| values.get(i).copied().unwrap_or(f64::NAN);
    let half = values.len() / 2;
    if values.len() % 2 == 1 { middle(half) } else { 0.5 * (middle(half) + middle(half.wrapping_sub(1))) }
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn median_of_even_and_odd_counts() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(vec![]).is_nan());
    }
}
