//! Eigen decompositions per second.

use crate::{level, row, tier};
use halflight::bench::REPETITIONS;
use halflight::bench::eigen::{BATCH, Entry, Speeds, run_with_rival};
use halflight_simd::Tier;

#[derive(clap::Args)]
pub(crate) struct Eigen {
    /// Highest instruction set of our kernels: baseline, avx2 or avx512 [default: the processor's]
    #[arg(long, value_name = "LEVEL", value_parser = tier)]
    simd: Option<Tier>,
}

impl Eigen {
    pub(crate) fn run(&self) -> Vec<String> {
        let mut rival: Option<Box<dyn Entry>> = None;
        #[cfg(feature = "nalgebra")]
        rival.replace(Box::new(crate::nalgebra::Nalgebra::default()));
        let (ours, theirs) = run_with_rival(level(self.simd), rival.as_deref_mut().map(|rival| rival as _));
        let millions =
            |speeds: &Speeds| [speeds.sym2, speeds.sym3].map(|speed| format!("{:.1}", 1e-6 * speed));
        let level = ours.level.name();
        let mut lines = vec![
            format!("symmetric matrices in batches of {BATCH}, {level}; medians of {REPETITIONS}, M/s"),
            row("", ["2x2", "3x3"].map(String::from)),
            row("halflight", millions(&ours.ours)),
        ];
        if let Some(theirs) = theirs {
            let ratios = [ours.ours.sym2 / theirs.sym2, ours.ours.sym3 / theirs.sym3];
            lines.push(row("nalgebra", millions(&theirs)));
            lines.push(row("ratio", ratios.map(|ratio| format!("{ratio:.1}"))));
        }
        lines
    }
}
