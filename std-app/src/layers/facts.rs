//! Facts of a render as attributes of an OpenEXR file.

use crate::provenance::Provenance;
use crate::render::{ErrorEstimate, Merged, RenderResult, Settings};
use crate::save::{Attribute, ExrFile};
use halflight_core::film::PixelWindow;
use halflight_core::findings::{Decision, Findings};

/// Facts of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Facts<'a> {
    /// File name of the scene.
    pub scene: Option<&'a str>,
    /// Name of the method.
    pub method: Option<&'a str>,
    /// Seed of all random numbers.
    pub seed: Option<u32>,
    /// Samples per pixel.
    pub spp: u32,
    /// Error of the picture.
    pub error: Option<ErrorEstimate>,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Window of the picture that was rendered; `None`: all.
    pub window: Option<PixelWindow>,
    /// Decisions of the render.
    pub findings: &'a Findings,
    /// Command, program, machine and date.
    pub provenance: &'a Provenance,
}

impl<'a> Facts<'a> {
    /// Facts of a render of the file `scene`.
    pub fn of_render(
        result: &'a RenderResult,
        (scene, settings): (&'a str, &Settings),
        provenance: &'a Provenance,
    ) -> Self {
        Self {
            scene: Some(scene),
            method: Some(result.method.name()),
            seed: Some(settings.seed),
            spp: result.spp,
            error: result.error,
            seconds: result.seconds.render,
            window: settings.shard.window,
            findings: &result.findings,
            provenance,
        }
    }

    /// Facts of a merged picture.
    pub fn of_merged(merged: &'a Merged, provenance: &'a Provenance) -> Self {
        let Merged { spp, seconds, error, findings, .. } = merged;
        Self {
            scene: None,
            method: None,
            seed: None,
            spp: *spp,
            error: *error,
            seconds: *seconds,
            window: None,
            findings,
            provenance,
        }
    }

    /// Adds the attributes to a file, and the place of its picture.
    pub fn add_to(&self, file: &mut ExrFile) {
        let Self { scene, method, seed, spp, error, seconds, window, findings, provenance } = self;
        window.iter().for_each(|window| file.set_window(*window));
        let text = |text: &str| Attribute::Text(text.to_owned());
        let integer = |number: u32| Attribute::Integer(i32::try_from(number).unwrap_or(i32::MAX));
        file.set("software", text(provenance.version));
        file.set("command", Attribute::Text(provenance.command_line()));
        // `2000-02-29 00:00 UTC` in the form of the standard attribute.
        let date = provenance.date.trim_end_matches(" UTC").replace('-', ":");
        file.set("capDate", Attribute::Text(format!("{date}:00")));
        file.set("utcOffset", Attribute::Number(0.0));
        if let Some(scene) = scene {
            file.set("scene", text(scene));
        }
        if let Some(method) = method {
            file.set("method", text(method));
        }
        if let Some(seed) = seed {
            // A seed above 2^31 has no whole number of OpenEXR.
            file.set(
                "seed",
                i32::try_from(*seed).map_or_else(|_| text(&seed.to_string()), Attribute::Integer),
            );
        }
        file.set("samplesPerPixel", integer(*spp));
        file.set("renderTime", Attribute::Number(*seconds as f32));
        if let Some(ErrorEstimate { relmse, lower, upper }) = error {
            file.set("relMSE", Attribute::Number(*relmse as f32));
            file.set("relMSEInterval", Attribute::Interval([*lower as f32, *upper as f32]));
        }
        let made = findings.get("reconstruction").is_some_and(|finding| finding.decision == Decision::Used);
        file.set("reconstruction", text(if made { "used" } else { "none" }));
    }
}
