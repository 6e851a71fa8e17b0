//! `halflight info`: contents of a scene, its camera, the features that it needs, and memory.

use super::camera_args::CameraArgs;
use super::failure::Failure;
use super::stdio::print_result;
use super::values;
use clap::Args;
use halflight::load::{self, LoadOptions, LoadedScene, NamedCamera};
use halflight::quantity::{readable_bytes, readable_name};
use halflight::report::{counts, left_out_array};
use halflight_core::bsdf::All;
use halflight_core::bvh::Bvh;
use halflight_core::census::{Census, Plan};
use halflight_core::film::Film;
use halflight_core::light::LightSampler;
use halflight_core::reconstruction::FilmReconstruction;
use halflight_core::scene::Camera;
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Print the contents of a scene, its camera and memory
#[derive(Args)]
pub(super) struct Info {
    /// Scene: a mesh (.obj), glTF (.glb, .gltf) or a scene file (.toml)
    scene: PathBuf,
    /// Size of the film whose memory is printed [default: that of the scene file, or 512x512]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    size: Option<[u32; 2]>,
    #[command(flatten)]
    camera: CameraArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

impl Info {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let loaded = load::load(&self.scene, &LoadOptions::default())?;
        let views = loaded.views();
        let scene = views.scene(self.camera.camera(&loaded)?);
        let census = Census::of(&scene);
        let [width, height] = self.size.or(loaded.settings.size.map(<[u32; 2]>::from)).unwrap_or([512, 512]);
        let [kept, search] = FilmReconstruction::footprints_of_view::<All>(&scene.mesh, [width, height]);
        let facts = Facts {
            footprints: [
                ("bvh", Bvh::kept_footprint_of(&scene.mesh).bytes()),
                ("bvh_build", Bvh::footprint_of(&scene.mesh).bytes()),
                ("lights", LightSampler::footprint(&scene).bytes()),
                ("film", Film::footprint(width, height).bytes()),
                ("reconstruction", kept.or(search).bytes()),
            ],
            plan: census.plan(),
            camera: CameraFacts::new(&scene.camera, &loaded),
            counts: counts(&census, &scene),
            cameras: &loaded.cameras,
            repairs: &loaded.repairs,
        };
        print_result(&if self.json { facts.object().to_string() } else { facts.text() })?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Camera in the units of the scene.
struct CameraFacts {
    vectors: [(&'static str, [f64; 3]); 3],
    fov: f64,
}

impl CameraFacts {
    fn new(camera: &Camera, loaded: &LoadedScene) -> Self {
        let focus = camera.eye + camera.forward * camera.focus_distance;
        let vectors = [
            ("eye", loaded.transform.to_user(camera.eye)),
            ("look_at", loaded.transform.to_user(focus)),
            ("up", camera.up.to_array().map(f64::from)),
        ];
        Self { vectors, fov: 2.0 * f64::from(camera.tan_half_fov).atan().to_degrees() }
    }
}

struct Facts<'a> {
    cameras: &'a [NamedCamera],
    repairs: &'a [String],
    camera: CameraFacts,
    counts: Vec<(&'static str, u64)>,
    plan: Plan,
    footprints: [(&'static str, usize); 5],
}

impl Facts<'_> {
    fn object(&self) -> Value {
        let mut camera: Map<String, Value> =
            self.camera.vectors.iter().map(|&(name, vector)| (name.into(), json!(vector))).collect();
        camera.insert("fov".into(), self.camera.fov.into());
        let counts = self.counts.iter().map(|&(name, count)| (name.into(), count.into()));
        let memory = self.footprints.iter().map(|&(name, bytes)| (name.into(), bytes.into()));
        json!({
            "method": self.plan.method,
            "features": self.plan.features.name(),
            "census": counts.collect::<Map<_, _>>(),
            "camera": camera,
            "cameras": self.cameras.iter().map(|camera| camera.name.as_str()).collect::<Value>(),
            "memory": memory.collect::<Map<_, _>>(),
            "left_out": left_out_array(self.plan.left_out()),
            "repairs": self.repairs,
        })
    }

    fn text(&self) -> String {
        let line = |name: &str, value: String| format!("  {:<24} {value}", readable_name(name));
        let mut lines = vec!["scene".to_string()];
        let counts = self.counts.iter().filter(|(_, count)| *count > 0);
        lines.extend(counts.map(|(name, count)| line(name, count.to_string())));
        lines.push("camera".into());
        lines.extend(self.camera.vectors.iter().map(|(name, vector)| {
            // Adding zero turns −0 into 0.
            let [x, y, z] = vector.map(|value| value + 0.0);
            format!("  --{:<22} {x:.6},{y:.6},{z:.6}", name.replace('_', "-"))
        }));
        lines.push(format!("  --{:<22} {:.3}", "fov", self.camera.fov));
        let named = |(number, camera): (usize, &NamedCamera)| {
            line("camera", format!("--camera {} ({})", number + 1, camera.name))
        };
        lines.extend(self.cameras.iter().enumerate().map(named));
        lines.push("plan".into());
        lines.push(format!("  compiled for: {}", self.plan.features.name()));
        lines.extend(self.plan.left_out().map(|(what, why)| format!("  left out: {what} ({why})")));
        lines.push("memory, at most".into());
        lines.extend(self.footprints.iter().map(|(name, bytes)| line(name, readable_bytes(*bytes))));
        if !self.repairs.is_empty() {
            lines.push("repaired".into());
            lines.extend(self.repairs.iter().map(|repair| format!("  {repair}")));
        }
        lines.join("\n")
    }
}
