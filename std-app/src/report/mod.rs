//! Reports: a page for people, `curve.csv` and `run.json` for programs. The page is one file without
//! references to others: it holds the object of `run.json` and the values of the pixels.

mod census;
mod curve;
mod fit;
mod folder;
mod json;
mod layers;
mod page;
mod race;

pub use census::counts;
pub use folder::{check_folder, report_files, write_folder};
pub use json::{comparison_object, dropped_object, error_object, file_name, findings_object, left_out_array};
pub use race::{Race, RaceEntry};

use crate::compare::Comparison;
pub use crate::provenance::Provenance;
use crate::render::{RenderResult, Settings};
use crate::save::Image;
use halflight_core::census::Census;
use halflight_core::findings::Decision;
use halflight_core::scene::Scene;
use layers::Layer;
use serde_json::Value;
use std::path::PathBuf;

/// A finished render and the facts that its report needs.
pub struct Run<'a> {
    /// Rendered scene.
    pub scene: &'a Scene<'a>,
    /// File name of the scene.
    pub name: &'a str,
    /// Repairs by the loader, one sentence each.
    pub repairs: &'a [String],
    /// Settings of the render.
    pub settings: &'a Settings,
    /// Result of the render.
    pub result: &'a RenderResult,
    /// Comparison with the reference of the settings.
    pub comparison: Option<&'a Comparison>,
    /// Pictures that were saved.
    pub outputs: &'a [PathBuf],
    /// Seconds of loading.
    pub load_seconds: f64,
    /// Seconds from the start of the program to the last picture saved.
    pub total_seconds: f64,
    /// Command, program, machine and date.
    pub provenance: &'a Provenance,
}

/// Names and contents of the files of a report.
pub type Files = Vec<(&'static str, Vec<u8>)>;

impl Run<'_> {
    /// Reason why the audit may be wrong; `None` if path tracing can be trusted.
    pub fn doubt(&self) -> Option<&'static str> {
        let audit = self.result.audit.as_ref();
        if audit.is_some_and(|audit| audit.is_blind) {
            return Some("the bias is unknown: path tracing cannot sample much of the light");
        }
        let has_doubt = match self.result.method.finds_caustics() {
            true => Census::of(self.scene).specular > 0,
            false => {
                let photons = self.result.findings.get("caustic_photons");
                let has_photons = photons.is_some_and(|finding| finding.decision != Decision::LeftOut);
                has_photons && audit.is_none_or(|audit| !audit.work.has_photons)
            }
        };
        has_doubt.then_some("path tracing, the judge, may miss light through mirrors and glass")
    }

    /// Object of `--json` (docs/cli.md).
    pub fn object(&self) -> Value {
        json::run(self)
    }

    /// Files of the report: `index.html`, `curve.csv`, `run.json`.
    pub fn files(&self) -> Files {
        let mut layers = layers::of_run(self, 0);
        layers.extend(self.reference().map(layers::of_reference));
        files(&layers, curve::csv(&[(None, &self.result.history)]), &self.object())
    }

    fn reference(&self) -> Option<&Image> {
        self.settings.reference.as_deref()
    }
}

impl Race<'_> {
    /// Object of `--json` (docs/cli.md).
    pub fn object(&self) -> Value {
        json::race(self)
    }

    /// Files of the report: `index.html`, `curve.csv`, `run.json`.
    pub fn files(&self) -> Files {
        let entries = self.entries.iter();
        let curves: Vec<_> =
            entries.map(|entry| (Some(entry.name.as_str()), &*entry.run.result.history)).collect();
        let layers = self.entries.iter().enumerate().flat_map(|(of, entry)| layers::of_run(&entry.run, of));
        let reference = self.entries.iter().find_map(|entry| entry.run.reference());
        let layers: Vec<_> = layers.chain(reference.map(layers::of_reference)).collect();
        files(&layers, curve::csv(&curves), &self.object())
    }
}

fn files(layers: &[Layer], curve: String, object: &Value) -> Files {
    let page = page::page(object, layers);
    let object = format!("{object:#}\n");
    vec![
        ("index.html", page.into_bytes()),
        ("curve.csv", curve.into_bytes()),
        ("run.json", object.into_bytes()),
    ]
}
