//! Reports: one page that a person likes to read, `curve.csv` and `run.json` for programs. The page is a
//! single file that asks for nothing else: pictures are in it as data, charts as SVG.

mod census;
mod curve;
mod fit;
mod folder;
mod json;
mod maker;
mod page;
mod race;
pub mod words;

pub use census::counts;
pub use folder::{check_folder, report_files, write_folder};
pub use json::{comparison_object, dropped_object, error_object};
pub use maker::Maker;
pub use race::{Race, Racer};

use crate::compare::Comparison;
use crate::drive::{Method, PhotonUse, RenderResult, Settings};
use crate::save::Image;
use halflight_core::census::Census;
use halflight_core::scene::Scene;
use serde_json::Value;
use std::path::PathBuf;

/// A render that is done, and all that is told about it.
pub struct Run<'a> {
    /// What was rendered.
    pub scene: &'a Scene<'a>,
    /// The name of its file.
    pub name: &'a str,
    /// What the loader repaired.
    pub repairs: &'a [String],
    /// How it was rendered.
    pub settings: &'a Settings,
    /// What came out.
    pub result: &'a RenderResult,
    /// How it differs from the reference of the settings.
    pub comparison: Option<&'a Comparison>,
    /// The pictures that were saved.
    pub outputs: &'a [PathBuf],
    /// Seconds of loading.
    pub load_seconds: f64,
    /// Seconds from the start of the program to the last picture saved.
    pub total_seconds: f64,
    /// Who made it.
    pub maker: &'a Maker,
}

impl Run<'_> {
    /// Why what an audit has found may not be a bias; `None` where path tracing can be trusted.
    pub fn doubt(&self) -> Option<&'static str> {
        if self.result.audit.as_ref().is_some_and(|audit| audit.is_blind) {
            return Some("the bias is not known: path tracing, the judge, cannot find much of the light");
        }
        let by_photons = self.result.method.finds_caustics() && Census::of(self.scene).specular > 0;
        let alone = self.result.audit.as_ref().is_none_or(|audit| !audit.has_photons);
        (by_photons || self.result.caustics.used && alone)
            .then_some("path tracing, the judge, may miss light through mirrors and glass")
    }

    /// What was left out and why.
    fn left_out(&self) -> Vec<(&'static str, &'static str)> {
        let mut left_out: Vec<_> = Census::of(self.scene).plan().left_out().collect();
        if !self.result.reuse.used {
            let measured = self.result.reuse.pilot.is_some();
            let why = if measured { "it would cost more than it gains" } else { "it was not asked for" };
            left_out.push(("reuse of paths by neighbouring pixels", why));
        }
        let caustics = self.result.caustics;
        if let (false, Some(_)) = (caustics.used, caustics.share) {
            left_out.push(("photons of caustics", "they would bring next to no light"));
        }
        if caustics.lacks_memory {
            left_out
                .push(("photons of caustics", "there was no memory for them: light may be missing or noisy"));
        }
        if let (false, Some(_)) = (self.result.windows.used, self.result.windows.gain) {
            left_out.push(("windows to the environment", "each place sees enough of it"));
        }
        if self.result.windows.lacks_memory {
            left_out.push((
                "windows to the environment",
                "there was no memory for them: light of the sky may be noisier",
            ));
        }
        if let (Method::PhotonMap, Some(PhotonUse { caustic: None, .. })) =
            (self.result.method, self.result.photons)
        {
            left_out.push(("map of caustics", "nothing is smooth enough to make any"));
        }
        left_out
    }
}

/// The files of a report by name.
pub type Files = Vec<(&'static str, Vec<u8>)>;

impl Run<'_> {
    /// The object of `--json`, which scripts rely on (docs/cli.md).
    pub fn object(&self) -> Value {
        json::run(self)
    }

    /// The files of its report: `index.html`, `curve.csv`, `run.json`.
    pub fn files(&self) -> Files {
        files(page::run(self), curve::csv(&[(None, &self.result.history)]), &self.object())
    }

    fn reference(&self) -> Option<&Image> {
        self.settings.reference.as_deref()
    }
}

impl Race<'_> {
    /// The object of `--json`, which scripts rely on (docs/cli.md).
    pub fn object(&self) -> Value {
        json::race(self)
    }

    /// The files of its report: `index.html`, `curve.csv`, `run.json`.
    pub fn files(&self) -> Files {
        let curves: Vec<_> = self
            .racers
            .iter()
            .map(|racer| (Some(racer.name.as_str()), racer.run.result.history.as_slice()))
            .collect();
        files(page::race(self), curve::csv(&curves), &self.object())
    }
}

fn files(page: String, curve: String, object: &Value) -> Files {
    let object = format!("{object:#}\n");
    vec![
        ("index.html", page.into_bytes()),
        ("curve.csv", curve.into_bytes()),
        ("run.json", object.into_bytes()),
    ]
}
