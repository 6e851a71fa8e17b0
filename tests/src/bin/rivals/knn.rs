//! Searches of the photon map per second.

use crate::{level, row, tier};
use halflight::bench::knn::{Data, KnnReport, Rival, RivalReport, Speed, WorkSize, run_with_rivals};
use halflight::bench::{BenchError, REPETITIONS};
use halflight_simd::{Level, Tier};

#[derive(clap::Args)]
pub(crate) struct Knn {
    /// Photons in the map
    #[arg(long, value_name = "N", default_value_t = WorkSize::FULL.photons)]
    photons: usize,
    /// Searches for the nearest photons; of density estimates a tenth of them
    #[arg(long, value_name = "N", default_value_t = WorkSize::FULL.queries)]
    queries: usize,
    /// Highest instruction set of our kernels: baseline, avx2 or avx512 [default: the processor's]
    #[arg(long, value_name = "LEVEL", value_parser = tier)]
    simd: Option<Tier>,
}

type Measured = (KnnReport, Vec<RivalReport>);

fn measure(data: &Data, level: Level) -> Result<Measured, BenchError> {
    #[cfg(any(feature = "kiddo", feature = "nanoflann"))]
    let points: Vec<[f32; 3]> = data.photons.iter().map(|surfel| surfel.position.to_array()).collect();
    let rivals: &[&dyn Rival] = &[
        #[cfg(feature = "kiddo")]
        &crate::kiddo::Kiddo(&points),
        #[cfg(feature = "nanoflann")]
        &crate::nanoflann::Nanoflann(&points),
    ];
    run_with_rivals(data, level, rivals)
}

impl Knn {
    pub(crate) fn run(&self) -> Result<Vec<String>, BenchError> {
        let (ours, rivals) = measure(&Data::new(self.photons, self.queries), level(self.simd))?;
        let mut lines = vec![
            format!(
                "{} photons, {} queries, {}; medians of {REPETITIONS}, thousands of queries a second",
                self.photons,
                self.queries,
                ours.level.name()
            ),
            format!(
                "build {:.3} s, {:.3} s on two threads, {:.1} bytes a photon",
                ours.build_seconds,
                ours.build_seconds_on_two,
                ours.bytes_per_photon()
            ),
        ];
        let mut heads = ["found", "one by one", "in batches"].map(String::from).to_vec();
        for rival in &rivals {
            let ratio = rival.build_seconds / ours.build_seconds;
            lines.push(format!("build of {}: {:.3} s, ratio {ratio:.2}", rival.name, rival.build_seconds));
            heads.extend([&rival.name, "ratio", "in batches"].map(String::from));
        }
        lines.push(row("", heads));
        for (i, (one, all)) in ours.single.iter().zip(&ours.batched).enumerate() {
            let thousands = |speed: &Speed| format!("{:.1}", 1e-3 * speed.queries_per_second);
            let mut cells = vec![format!("{:.1}", one.photons), thousands(one), thousands(all)];
            for theirs in rivals.iter().filter_map(|rival| rival.speeds.get(i)) {
                let ratio =
                    |ours: &Speed| format!("{:.2}", ours.queries_per_second / theirs.queries_per_second);
                cells.extend([thousands(theirs), ratio(one), ratio(all)]);
            }
            lines.push(row(&one.task.name(), cells));
        }
        Ok(lines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::bench::knn::Task;

    #[test]
    fn rivals_find_as_many_photons_as_the_map() {
        let (ours, rivals) = measure(&Data::new(20_000, 400), Level::detect()).unwrap();
        let expected = usize::from(cfg!(feature = "kiddo")) + usize::from(cfg!(feature = "nanoflann"));
        assert_eq!(rivals.len(), expected);
        for rival in &rivals {
            for (ours, theirs) in ours.single.iter().zip(&rival.speeds) {
                if let Task::Nearest { .. } = ours.task {
                    assert_eq!(theirs.photons, ours.photons, "{} {:?}", rival.name, ours.task);
                }
            }
        }
    }
}
