//! `halflight info`: contents of a scene, its camera, the features that it needs, and memory.

use super::camera_args::CameraArgs;
use super::failure::Failure;
use super::stdio::print_result;
use super::values;
use clap::Args;
use halflight::load::{self, LoadOptions, LoadedScene, NamedCamera, ViewKind};
use halflight::quantity::{readable_bytes, readable_name};
use halflight::report::{counts, left_out_array};
use halflight_core::bsdf::All;
use halflight_core::bvh::Bvh;
use halflight_core::census::{Census, Plan};
use halflight_core::film::Film;
use halflight_core::light::LightSampler;
use halflight_core::reconstruction::FilmReconstruction;
use halflight_core::scene::{Camera, CameraKind, Environment};
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
            sun: scene.environment.as_ref().and_then(SunFacts::new),
            counts: counts(&census, &scene),
            cameras: &loaded.cameras,
            objects: &loaded.object_names,
            repairs: &loaded.repairs,
        };
        print_result(&if self.json { facts.object().to_string() } else { facts.text() })?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Camera in the units of the scene.
struct CameraFacts {
    vectors: [(&'static str, [f64; 3]); 3],
    kind: ViewKind,
    /// 0 of a pinhole.
    lens_radius: f64,
}

impl CameraFacts {
    fn new(camera: &Camera, loaded: &LoadedScene) -> Self {
        let focus = camera.eye + camera.forward * camera.focus_distance;
        let vectors = [
            ("eye", loaded.transform.to_user(camera.eye)),
            ("look_at", loaded.transform.to_user(focus)),
            ("up", camera.up.to_array().map(f64::from)),
        ];
        let to_user = |length| length * 2f64.powi(loaded.transform.exponent);
        let kind = match camera.kind {
            CameraKind::Perspective => ViewKind::Perspective {
                fov_degrees: 2.0 * f64::from(camera.tan_half_fov).atan().to_degrees(),
            },
            CameraKind::Orthographic { half_height } => {
                ViewKind::Orthographic { height: to_user(2.0 * f64::from(half_height)) }
            }
            CameraKind::Panorama => ViewKind::Panorama,
        };
        Self { vectors, kind, lens_radius: to_user(camera.lens_radius.into()) }
    }
}

/// Sun of a sky: degrees above the horizon, and from north to east.
struct SunFacts {
    elevation: f64,
    azimuth: f64,
}

impl SunFacts {
    fn new(environment: &Environment) -> Option<Self> {
        // The map of a sky has north, zenith and east along its axes.
        let towards = environment.to_map.as_dmat3() * environment.disc?.direction.as_dvec3();
        let [north, up, east] = towards.to_array();
        let elevation = up.atan2(north.hypot(east)).to_degrees();
        Some(Self { elevation, azimuth: east.atan2(north).to_degrees().rem_euclid(360.0) })
    }
}

/// Name of a kind in scene files.
fn name_of(kind: ViewKind) -> &'static str {
    match kind {
        ViewKind::Perspective { .. } => "perspective",
        ViewKind::Orthographic { .. } => "orthographic",
        ViewKind::Panorama => "panorama",
    }
}

struct Facts<'a> {
    cameras: &'a [NamedCamera],
    objects: &'a [String],
    repairs: &'a [String],
    camera: CameraFacts,
    sun: Option<SunFacts>,
    counts: Vec<(&'static str, u64)>,
    plan: Plan,
    footprints: [(&'static str, usize); 5],
}

impl Facts<'_> {
    fn object(&self) -> Value {
        let mut camera: Map<String, Value> =
            self.camera.vectors.iter().map(|&(name, vector)| (name.into(), json!(vector))).collect();
        let (key, value) = match self.camera.kind {
            ViewKind::Perspective { fov_degrees } => ("fov", Value::from(fov_degrees)),
            ViewKind::Orthographic { height } => ("height", height.into()),
            ViewKind::Panorama => ("fov", Value::Null),
        };
        camera.insert(key.into(), value);
        camera.insert("kind".into(), name_of(self.camera.kind).into());
        camera.insert("lens_radius".into(), self.camera.lens_radius.into());
        let counts = self.counts.iter().map(|&(name, count)| (name.into(), count.into()));
        let memory = self.footprints.iter().map(|&(name, bytes)| (name.into(), bytes.into()));
        json!({
            "method": self.plan.method,
            "features": self.plan.features.name(),
            "census": counts.collect::<Map<_, _>>(),
            "camera": camera,
            "sun": self.sun.as_ref().map(|sun| json!({ "elevation": sun.elevation, "azimuth": sun.azimuth })),
            "cameras": self.cameras.iter().map(|camera| camera.name.as_str()).collect::<Value>(),
            "objects": self.objects,
            "memory": memory.collect::<Map<_, _>>(),
            "left_out": left_out_array(self.plan.left_out()),
            "repairs": self.repairs,
        })
    }

    /// The number of objects, and the names of the first ones.
    fn object_names(&self) -> String {
        const SHOWN: usize = 8;
        let (count, shown) = (self.objects.len(), self.objects.iter().take(SHOWN));
        let names: Vec<&str> = shown.map(String::as_str).collect();
        format!("{count}: {}{}", names.join(", "), if count > SHOWN { ", ..." } else { "" })
    }

    fn text(&self) -> String {
        let line = |name: &str, value: String| format!("  {:<24} {value}", readable_name(name));
        let mut lines = vec!["scene".to_string()];
        let counts = self.counts.iter().filter(|(_, count)| *count > 0);
        lines.extend(counts.map(|(name, count)| line(name, count.to_string())));
        lines.push(line("objects", self.object_names()));
        lines.push("camera".into());
        lines.extend(self.camera.vectors.iter().map(|(name, vector)| {
            // Adding zero turns −0 into 0.
            let [x, y, z] = vector.map(|value| value + 0.0);
            format!("  --{:<22} {x:.6},{y:.6},{z:.6}", name.replace('_', "-"))
        }));
        match self.camera.kind {
            ViewKind::Perspective { fov_degrees } => {
                lines.push(format!("  --{:<22} {fov_degrees:.3}", "fov"));
            }
            ViewKind::Orthographic { height } => {
                lines.push(line("kind", format!("{}, height {height:.6}", name_of(self.camera.kind))));
            }
            ViewKind::Panorama => lines.push(line("kind", name_of(self.camera.kind).into())),
        }
        if self.camera.lens_radius > 0.0 {
            lines.push(format!("  --{:<22} {:.6}", "lens", self.camera.lens_radius));
        }
        let named = |(number, camera): (usize, &NamedCamera)| {
            line("camera", format!("--camera {} ({})", number + 1, camera.name))
        };
        lines.extend(self.cameras.iter().enumerate().map(named));
        lines.extend(self.sun.iter().map(|SunFacts { elevation, azimuth }| {
            line("sun", format!("{elevation:.3} degrees above the horizon, azimuth {azimuth:.3}"))
        }));
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
