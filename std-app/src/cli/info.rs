//! `halflight info`: what a scene holds, how it would be rendered, what is left out and why, and how many
//! bytes each structure takes.

use super::failure::Failure;
use super::say;
use super::values;
use super::view::ViewFlags;
use clap::Args;
use halflight::load::{self, LoadOptions, LoadedScene};
use halflight::report::counts;
use halflight::report::words::readable_bytes;
use halflight_core::bvh::Bvh;
use halflight_core::census::{Census, Plan};
use halflight_core::film::Film;
use halflight_core::light::LightSampler;
use halflight_core::scene::Camera;
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Say what a scene holds and how it would be rendered
#[derive(Args)]
pub(super) struct Info {
    /// The scene: a mesh (.obj) or a scene file (.toml)
    scene: PathBuf,
    /// Size of the picture, for the memory of its film [default: 512x512]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    size: Option<[u32; 2]>,
    #[command(flatten)]
    view: ViewFlags,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

impl Info {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let loaded = load::load(&self.scene, &LoadOptions::default())?;
        let views = loaded.views();
        let scene = views.scene(self.view.camera(&loaded)?);
        let census = Census::of(&scene);
        let [width, height] = self.size.or(loaded.settings.size).unwrap_or([512, 512]);
        let facts = Facts {
            footprints: [
                ("bvh", Bvh::kept_footprint(scene.mesh.triangles.len()).bytes()),
                ("bvh_build", Bvh::footprint(scene.mesh.triangles.len()).bytes()),
                ("lights", LightSampler::footprint(&scene).bytes()),
                ("film", Film::footprint(width, height).bytes()),
            ],
            plan: census.plan(),
            camera: scene.camera,
            counts: counts(&census, &scene),
            loaded: &loaded,
        };
        say(&if self.json { facts.object().to_string() } else { facts.text() })?;
        Ok(ExitCode::SUCCESS)
    }
}

struct Facts<'a> {
    loaded: &'a LoadedScene,
    camera: Camera,
    counts: Vec<(&'static str, u64)>,
    plan: Plan,
    footprints: [(&'static str, usize); 4],
}

impl Facts<'_> {
    fn object(&self) -> Value {
        let map = |pairs: &mut dyn Iterator<Item = (&'static str, u64)>| -> Map<String, Value> {
            pairs.map(|(name, count)| (name.into(), count.into())).collect()
        };
        let left_out: Vec<Value> =
            self.plan.left_out().map(|(what, why)| json!({ "what": what, "why": why })).collect();
        json!({
            "method": self.plan.method,
            "features": self.plan.features.name(),
            "census": map(&mut self.counts.iter().copied()),
            "camera": self.camera_words(),
            "memory": map(&mut self.footprints.iter().map(|&(name, bytes)| (name, bytes as u64))),
            "left_out": left_out,
            "repairs": self.loaded.repairs,
        })
    }

    fn camera_words(&self) -> Value {
        let camera = &self.camera;
        let focus = camera.eye + camera.forward * camera.focus_distance;
        json!({
            "eye": self.loaded.transform.to_user(camera.eye),
            "look_at": self.loaded.transform.to_user(focus),
            "up": camera.up.to_array(),
            "fov": 2.0 * f64::from(camera.tan_half_fov).atan().to_degrees(),
        })
    }

    fn text(&self) -> String {
        let mut lines = vec!["scene".to_string()];
        for (name, count) in self.counts.iter().filter(|(_, count)| *count > 0) {
            lines.push(format!("  {:<24} {count}", name.replace('_', " ")));
        }
        lines.push("camera".into());
        for part in ["eye", "look_at", "up"] {
            let vector = |value: &Value| value.as_f64().map_or(String::new(), |x| format!("{:.6}", x + 0.0));
            let numbers: Vec<String> =
                self.camera_words()[part].as_array().into_iter().flatten().map(vector).collect();
            lines.push(format!("  --{:<22} {}", part.replace('_', "-"), numbers.join(",")));
        }
        lines.push(format!(
            "  --{:<22} {:.3}",
            "fov",
            self.camera_words()["fov"].as_f64().unwrap_or_default()
        ));
        lines.push("plan".into());
        lines.push(format!("  method {}, compiled for: {}", self.plan.method, self.plan.features.name()));
        for (what, why) in self.plan.left_out() {
            lines.push(format!("  left out: {what} ({why})"));
        }
        lines.push("memory, at most".into());
        for (name, bytes) in self.footprints {
            lines.push(format!("  {:<24} {}", name.replace('_', " "), readable_bytes(bytes)));
        }
        if !self.loaded.repairs.is_empty() {
            lines.push("repaired".into());
            lines.extend(self.loaded.repairs.iter().map(|repair| format!("  {repair}")));
        }
        lines.join("\n")
    }
}
