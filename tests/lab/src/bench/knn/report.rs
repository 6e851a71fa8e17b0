//! Results of the photon benchmark, as text and as an object.

use super::{Data, Task};
use crate::bench::{REPETITIONS, row};
use halflight_core::Level;
use serde_json::{Value, json};

/// Result of our photon map, and of other libraries.
pub(super) struct Report {
    /// Seconds to copy the photons and build the map.
    pub(super) build_seconds: f64,
    /// Seconds of the same on two threads.
    pub(super) build_seconds_on_two: f64,
    /// Bytes of the map with its photons.
    pub(super) bytes: usize,
    /// Speeds with one query per call, for each of [`Task::ALL`].
    pub(super) single: Vec<Speed>,
    /// Speeds with all queries in one call, for each of [`Task::ALL`].
    pub(super) batched: Vec<Speed>,
    pub(super) rivals: Vec<RivalReport>,
}

/// Result of another library.
pub(super) struct RivalReport {
    pub(super) name: String,
    /// Seconds to build the tree.
    pub(super) build_seconds: f64,
    /// Speeds for each of [`Task::ALL`].
    pub(super) speeds: Vec<Speed>,
}

/// Speed of a task.
#[derive(Clone, Copy)]
pub(super) struct Speed {
    pub(super) task: Task,
    /// Queries per second, NaN without queries.
    pub(super) queries_per_second: f64,
    /// Mean number of photons found by a query.
    pub(super) photons: f64,
}

/// Values of speeds by the name of the task.
fn by_task(speeds: &[Speed], value: fn(&Speed) -> f64) -> Value {
    speeds.iter().map(|speed| (speed.task.name(), value(speed))).collect()
}

impl Report {
    fn bytes_per_photon(&self, data: &Data) -> f64 {
        self.bytes as f64 / data.photons.len() as f64
    }

    /// Object of `--json`.
    pub(super) fn object(&self, data: &Data, level: Level) -> Value {
        let rival = |rival: &RivalReport| {
            json!({
                "name": rival.name,
                "build_seconds": rival.build_seconds,
                "queries_per_second": by_task(&rival.speeds, |speed| speed.queries_per_second),
            })
        };
        json!({
            "level": level.name(),
            "build_seconds": self.build_seconds,
            "build_seconds_on_two_threads": self.build_seconds_on_two,
            "bytes_per_photon": self.bytes_per_photon(data),
            "queries_per_second": by_task(&self.single, |speed| speed.queries_per_second),
            "queries_per_second_in_batches": by_task(&self.batched, |speed| speed.queries_per_second),
            "found": by_task(&self.single, |speed| speed.photons),
            "rivals": self.rivals.iter().map(rival).collect::<Value>(),
            "photons": data.photons.len(),
            "queries": data.queries.len(),
            "repetitions": REPETITIONS,
        })
    }

    /// Table with two columns of ours and three of each other library: its speed, and ours over it for single
    /// queries and for batches.
    pub(super) fn lines(&self, data: &Data, level: Level) -> Vec<String> {
        let mut lines = vec![
            format!(
                "{} photons, {} queries, one thread, {}; medians of {REPETITIONS}, thousands of queries per \
                 second",
                data.photons.len(),
                data.queries.len(),
                level.name()
            ),
            format!(
                "build {:.3} s, {:.3} s on two threads, {:.1} bytes per photon",
                self.build_seconds,
                self.build_seconds_on_two,
                self.bytes_per_photon(data)
            ),
        ];
        let mut heads = ["found", "single", "batches"].map(String::from).to_vec();
        for RivalReport { name, build_seconds, .. } in &self.rivals {
            let ratio = build_seconds / self.build_seconds;
            lines.push(format!("build of {name}: {build_seconds:.3} s, ratio {ratio:.2}"));
            heads.extend([name, "ratio", "of batches"].map(String::from));
        }
        lines.push(row("", heads));
        for (i, (single, batched)) in self.single.iter().zip(&self.batched).enumerate() {
            let thousands = |speed: &Speed| format!("{:.1}", 1e-3 * speed.queries_per_second);
            let mut cells = vec![format!("{:.1}", single.photons), thousands(single), thousands(batched)];
            for theirs in self.rivals.iter().filter_map(|rival| rival.speeds.get(i)) {
                let over =
                    |ours: &Speed| format!("{:.2}", ours.queries_per_second / theirs.queries_per_second);
                cells.extend([thousands(theirs), over(single), over(batched)]);
            }
            lines.push(row(&single.task.name(), cells));
        }
        lines
    }
}
