//! Results of the ray benchmark, as text and as an object.

use super::classes::Class;
use crate::bench::{REPETITIONS, row};
use halflight_core::Level;
use serde_json::{Value, json};

/// Result of our ray tracer, and of another library.
pub(super) struct Report {
    /// Instruction set of our kernels.
    pub(super) level: Level,
    /// Width and height of the picture, with one camera ray per pixel.
    pub(super) size: [u32; 2],
    /// Triangles of the scene.
    pub(super) triangles: usize,
    /// Seconds to allocate memory and build the BVH.
    pub(super) build_seconds: f64,
    /// Bytes of the BVH with its copy of the triangles.
    pub(super) bytes: usize,
    /// Results for each of [`Class::ALL`].
    pub(super) classes: Vec<ClassReport>,
    pub(super) rivals: Vec<RivalReport>,
}

/// Result of our ray tracer for one class.
pub(super) struct ClassReport {
    pub(super) class: Class,
    /// Number of rays.
    pub(super) rays: usize,
    /// Number of rays with a hit.
    pub(super) hits: usize,
    /// Millions of rays per second, NaN without rays.
    pub(super) mrays_per_second: f64,
}

/// Result of another library.
pub(super) struct RivalReport {
    /// Name and version.
    pub(super) name: String,
    /// Seconds to build the hierarchy.
    pub(super) build_seconds: f64,
    /// Results of all functions, for each of [`Class::ALL`].
    pub(super) classes: Vec<Vec<EntryReport>>,
}

/// Result of one function for one class.
#[derive(Clone)]
pub(super) struct EntryReport {
    /// Name of the function.
    pub(super) entry: &'static str,
    /// Number of rays with a hit.
    pub(super) hits: usize,
    /// Millions of rays per second, NaN without rays.
    pub(super) mrays_per_second: f64,
}

impl RivalReport {
    /// The fastest function of each class.
    fn fastest(&self) -> Vec<EntryReport> {
        let fastest = |entries: &Vec<EntryReport>| {
            entries.iter().max_by(|a, b| a.mrays_per_second.total_cmp(&b.mrays_per_second)).cloned()
        };
        self.classes.iter().filter_map(fastest).collect()
    }
}

impl Report {
    fn bytes_per_triangle(&self) -> f64 {
        self.bytes as f64 / self.triangles as f64
    }

    /// Object of `--json`. Speeds without rays are `null`.
    pub(super) fn object(&self) -> Value {
        let by_class = |value: fn(&ClassReport) -> Value| -> Value {
            self.classes.iter().map(|class| (class.class.name(), value(class))).collect()
        };
        let rival = |rival: &RivalReport| {
            let fastest = rival.fastest();
            let by_class = || self.classes.iter().map(|class| class.class.name()).zip(&fastest);
            let speeds: Value = by_class().map(|(class, entry)| (class, entry.mrays_per_second)).collect();
            let entries: Value = by_class().map(|(class, entry)| (class, entry.entry)).collect();
            json!({
                "name": rival.name,
                "build_seconds": rival.build_seconds,
                "mrays_per_second": speeds,
                "entries": entries,
            })
        };
        json!({
            "level": self.level.name(),
            "width": self.size[0],
            "height": self.size[1],
            "build_seconds": self.build_seconds,
            "bytes_per_triangle": self.bytes_per_triangle(),
            "mrays_per_second": by_class(|class| class.mrays_per_second.into()),
            "rivals": self.rivals.iter().map(rival).collect::<Value>(),
            "triangles": self.triangles,
            "repetitions": REPETITIONS,
            "rays": by_class(|class| class.rays.into()),
            "hits": by_class(|class| class.hits.into()),
        })
    }

    /// Table with the speeds of ours, the fastest of another library, and the ratio.
    pub(super) fn lines(&self) -> Vec<String> {
        let [width, height] = self.size;
        let of_classes = |cell: fn(&ClassReport) -> String| self.classes.iter().map(cell);
        let seconds = |seconds: f64| format!("{seconds:.3}");
        let speeds = of_classes(|class| format!("{:.2}", class.mrays_per_second));
        let hits =
            of_classes(|class| format!("{:.1} %", 100.0 * class.hits as f64 / class.rays.max(1) as f64));
        let mut lines = vec![
            format!(
                "{} triangles, {:.1} bytes each, one thread, {}; medians of {REPETITIONS}, Mray/s; \
                 {width}x{height} camera rays",
                self.triangles,
                self.bytes_per_triangle(),
                self.level.name(),
            ),
            row("", of_classes(|class| class.class.name().into()).chain(["build [s]".into()])),
            row("halflight", speeds.chain([seconds(self.build_seconds)])),
            row("hits", hits),
        ];
        for rival in &self.rivals {
            let fastest = rival.fastest();
            let over = |(ours, theirs): (&ClassReport, &EntryReport)| {
                ours.mrays_per_second / theirs.mrays_per_second
            };
            let ratios: Vec<f64> = self.classes.iter().zip(&fastest).map(over).collect();
            let mean = (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp();
            let speeds = fastest.iter().map(|entry| format!("{:.2}", entry.mrays_per_second));
            let build = rival.build_seconds / self.build_seconds;
            let entries: Vec<&str> = fastest.iter().map(|entry| entry.entry).collect();
            lines.push(row(&rival.name, speeds.chain([seconds(rival.build_seconds)])));
            lines.push(row("ratio", ratios.iter().chain([&build]).map(|ratio| format!("{ratio:.2}"))));
            let entries = entries.join(", ");
            lines.push(format!("geometric mean of rays {mean:.2}; fastest entry points: {entries}"));
        }
        lines
    }
}
