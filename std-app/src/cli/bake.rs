//! `halflight bake`: irradiance at points, each with its interval.

mod lightmap;
mod probes;

use super::bake_files::TableFiles;
use super::bake_parts::BakeParts;
use super::failure::Failure;
use super::interrupt::{self, INTERRUPT};
use super::outputs::Outputs;
use super::picture_args::{Caustics, note_darkness, render_failure};
use super::progress::{ProgressArgs, ProgressReporter};
use super::{print_note, values};
use clap::{ArgGroup, Args, ValueEnum};
use halflight::bake::{
    self, BakeSettings, Baked, Quantity, TableFormat, attachment, read_sensors, vertices, write_table,
};
use halflight::load::{self, LoadOptions, LoadedScene};
use halflight::memory::Budget;
use halflight::quantity::readable_seconds;
use halflight::render::Stop;
use halflight::report::{file_name, findings_object};
use halflight::values::{Depth, Samples, TargetError};
use halflight_core::{IrradiancePoint, LightPart, PointMethod};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Estimate irradiance at points, each with its 95 % interval
///
/// Points are the sensors of a grid, a line `x y z nx ny nz` each, the vertices of the scene, the texels of
/// a lightmap, or light probes. A sensor that lies on a surface within rounding is put on it, on the side of
/// its normal. The first of --spp, --time and --error that holds ends the work; without one it ends when the
/// intervals are 2 %, or after 60 s.
#[derive(Args)]
#[command(group = ArgGroup::new("subject").required(true).args(["points", "vertices", "lightmap", "probes"]))]
pub(super) struct Bake {
    /// Scene: a mesh (.obj), glTF (.glb, .gltf) or a scene file (.toml)
    scene: PathBuf,
    /// Sensors, a line `x y z nx ny nz` each; `-` is standard input
    #[arg(long, value_name = "FILE")]
    points: Option<PathBuf>,
    /// All vertices of the scene, on the front of their triangles
    #[arg(long)]
    vertices: bool,
    #[command(flatten)]
    lightmap: lightmap::LightmapArgs,
    #[command(flatten)]
    probes: probes::ProbeArgs,
    /// Table: .csv, .res (R G B a line) or .ply; may be repeated [default: CSV on standard output]. Lightmap:
    /// .exr, .hdr or .pfm. Probes: .json, .csv or .ktx2
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Quantity of the values
    #[arg(long, default_value = "irradiance")]
    unit: Unit,
    /// Light to estimate
    #[arg(long, default_value = "all")]
    light: Light,

    /// Caustic photons, which find light through glass and by mirrors
    #[arg(long, default_value = "auto")]
    caustics: Caustics,

    /// Source of indirect light. A cache shares it among near points, and an audit adds its bias to the
    /// intervals; `auto` takes one where it is predicted to have less error
    #[arg(long, default_value = "path")]
    method: Method,

    /// Samples per point; fewer than 64 points have several independent estimates of so many samples
    #[arg(long, value_name = "N", value_parser = values::checked::<u32, Samples>)]
    spp: Option<Samples>,
    /// Time, as in 30s, 2m, 1h
    #[arg(long, value_name = "TIME", value_parser = values::duration)]
    time: Option<f64>,
    /// End tiles of 256 near points one by one, when 95 % of their intervals are within this part of the
    /// value and a tenth of the mean
    #[arg(long, value_name = "RELATIVE", value_parser = values::checked::<f64, TargetError>)]
    error: Option<TargetError>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Most segments of a path; 2 is direct light
    #[arg(long, value_name = "N", value_parser = values::checked::<u32, Depth>)]
    max_depth: Option<Depth>,
    /// Number of threads [default: all hardware threads]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    threads: Option<u32>,
    /// Memory limit for files, scene and all structures, as in 512M or 2G [default: four fifths of the
    /// machine's]
    #[arg(long, value_name = "BYTES", value_parser = values::bytes)]
    memory: Option<usize>,
    #[command(flatten)]
    parts: BakeParts,
    #[command(flatten)]
    progress: ProgressArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Unit {
    /// W/m²
    Irradiance,
    /// Radiance of a white diffuse surface: irradiance / π
    White,
    /// Illuminance by Radiance's weights
    Lux,
}

#[derive(Clone, Copy, ValueEnum)]
enum Light {
    /// All light
    All,
    /// Light directly from emitters
    Direct,
    /// Light that surfaces have scattered
    Indirect,
}

#[derive(Clone, Copy, ValueEnum)]
enum Method {
    /// Path tracing at every point
    Path,
    /// Irradiance cache
    IrradianceCache,
    /// Either
    Auto,
}

impl Bake {
    /// Number of threads; `None`: all of the machine.
    pub(super) fn threads(&self) -> Option<usize> {
        self.threads.map(|threads| threads as usize)
    }

    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        self.progress.apply();
        if self.parts.is_part() && !matches!(self.method, Method::Path) {
            let why = "a shard has no irradiance cache: the audit that keeps or leaves it needs points of all shards";
            return Err(Failure::new(why).advice("leave out --method, or --shard"));
        }
        if let Some(run) = self.lightmap.run(self).or_else(|| self.probes.run(self)) {
            return run;
        }
        let mut outputs = Outputs::new(self.json);
        let tables = TableFiles::new(&self.output)?;
        tables.plan(&mut outputs)?;
        self.parts.plan(&mut outputs)?;
        let file = self.points.as_deref().filter(|file| *file != Path::new("-"));
        file.map_or(Ok(()), |file| outputs.protect(file))?;
        let mut budget = Budget::new(self.memory);
        let given = self.points.as_deref().map(|file| read_sensors(file, budget.left())).transpose()?;
        budget.take(given.as_ref().map_or(0, |sensors| size_of_val(&sensors[..])))?;
        let options = LoadOptions { memory: Some(budget.left()), copies: true, ..LoadOptions::default() };
        let loaded = self.load(&outputs, &options)?;
        let (points, sensors) = match given {
            Some(sensors) => (sensors.iter().map(|sensor| sensor.point(&loaded)).collect(), sensors),
            None => vertices(&loaded),
        };
        let attached = attachment(&sensors, self.quantity());
        let baked = self.bake(&loaded, &points, (self.memory, attached), 0.0)?;
        baked.unsaved.iter().for_each(|why| outputs.fail(why.clone()));
        tables.save(&mut outputs, (&sensors, &baked, self.quantity()));
        if self.output.is_empty() && !self.json && !self.parts.is_part() {
            let mut table = Vec::new();
            let columns = (&baked.values[..], &baked.back_faces[..]);
            write_table(&mut table, (TableFormat::Csv, self.quantity()), &sensors, columns)?;
            print_note(self.text(&baked));
            let table = String::from_utf8_lossy(&table);
            return Ok(outputs.end(table.trim_end(), code(&baked)));
        }
        Ok(outputs.end_with(|| self.object(&baked), || self.text(&baked), code(&baked)))
    }

    fn load(&self, outputs: &Outputs, options: &LoadOptions) -> Result<LoadedScene, Failure> {
        outputs.protect(&self.scene)?;
        let loaded = load::load(&self.scene, options)?;
        loaded.files.iter().try_for_each(|file| outputs.protect(file))?;
        loaded.repairs.iter().for_each(print_note);
        interrupt::install_handler()?;
        Ok(loaded)
    }

    /// Bakes `points` after so many seconds of the time limit.
    fn bake(
        &self,
        loaded: &LoadedScene,
        points: &[IrradiancePoint],
        (memory, attached): (Option<usize>, Vec<u8>),
        spent: f64,
    ) -> Result<Baked, Failure> {
        let views = loaded.views();
        let scene = views.scene(loaded.camera_or_default());
        let stop =
            Stop { spp: self.spp.map(u32::from), seconds: self.time, error: self.error.map(f64::from) };
        let stop = if stop == Stop::default() { BakeSettings::SENSIBLE } else { stop };
        let stop = match note_darkness(&scene) {
            true => Stop { spp: stop.spp.or(Some(4)), ..stop },
            false => stop,
        };
        // Points have samples after the end as well.
        let left = |seconds: f64| (seconds - spent).max(f64::MIN_POSITIVE);
        let settings = BakeSettings {
            stop: Stop { seconds: stop.seconds.map(left), ..stop },
            light: match self.light {
                Light::All => LightPart::All,
                Light::Direct => LightPart::Direct,
                Light::Indirect => LightPart::Indirect,
            },
            caustics: self.caustics == Caustics::Auto,
            method: match self.method {
                Method::Path => PointMethod::Path,
                Method::IrradianceCache => PointMethod::IrradianceCache,
                Method::Auto => PointMethod::Auto,
            },
            seed: self.seed,
            max_depth: self.max_depth.map(u32::from),
            threads: self.threads(),
            memory,
            back_faces: self.has_back_faces(),
            ..BakeSettings::default()
        };
        let settings = self.parts.add_to(settings, attached);
        let mut reporter = ProgressReporter::new();
        let mut progress = |progress: &bake::BakeProgress| {
            let [tiles, finished] = progress.tiles;
            let within = self.error.map_or(String::new(), |_| format!(", {finished} of {tiles} tiles"));
            let seconds = readable_seconds(progress.seconds);
            let text = match progress.counting {
                Some(part) => format!("fractions of back faces, {:.0} %, {seconds}", 100.0 * part),
                None => format!("{} samples per point{within}, {seconds}", progress.samples),
            };
            let state =
                json!({ "samples": progress.samples, "tiles": { "all": tiles, "finished": finished } });
            reporter.report_text((&text, state), progress.seconds, progress.seconds_left);
        };
        let baked = bake::irradiance(&scene, points, &settings, &mut progress, &INTERRUPT);
        reporter.end();
        let baked = baked.map_err(|error| render_failure(&self.scene, &error))?;
        let missing = baked.values.iter().filter(|value| value.samples == 0).count();
        if missing > 0 && !self.parts.is_part() {
            print_note(format!("{missing} points have no samples yet: their values are 0"));
        }
        Ok(baked)
    }

    /// True if an output has the fractions of back faces.
    fn has_back_faces(&self) -> bool {
        let is_res = |path: &PathBuf| TableFormat::of(path) == Some(TableFormat::Res);
        self.output.is_empty() || !self.output.iter().all(is_res)
    }

    fn quantity(&self) -> Quantity {
        match self.unit {
            Unit::Irradiance => Quantity::Irradiance,
            Unit::White => Quantity::White,
            Unit::Lux => Quantity::Lux,
        }
    }

    fn object(&self, baked: &Baked) -> Value {
        let [build, sampling] = baked.seconds;
        let [tiles, finished] = baked.tiles;
        let mut samples: Vec<u32> = baked.values.iter().map(|value| value.samples).collect();
        samples.sort_unstable();
        let at = |part: usize| samples.get((samples.len() - 1) * part / 2).copied();
        json!({
            "points": baked.values.len(),
            "samples": { "least": at(0), "median": at(1), "most": at(2) },
            "tiles": tiles,
            "within_error": self.error.map(|_| finished),
            "half_width": baked.median_half_width(),
            "mean": baked.mean(),
            "seconds": { "build": build, "sampling": sampling },
            "findings": findings_object(&baked.findings),
            "rays": baked.counters.all_rays(),
            "paths": baked.counters.paths,
            "dropped": baked.counters.dropped.total(),
            "interrupted": baked.is_interrupted,
            "outputs": self.output.iter().map(|path| file_name(path)).collect::<Value>(),
        })
    }

    fn text(&self, baked: &Baked) -> String {
        let [build, sampling] = baked.seconds.map(readable_seconds);
        let half_width =
            baked.median_half_width().map_or("unknown".into(), |half| format!("{:.2} %", 100.0 * half));
        let is_own = |samples: &u32| *samples > 0 || !self.parts.is_part();
        let fewest = baked.values.iter().map(|value| value.samples).filter(is_own).min().unwrap_or_default();
        format!(
            "{} points, at least {fewest} samples each; median half-width of the intervals {half_width}; \
             built in {build}, sampled in {sampling}",
            baked.values.len(),
        )
    }
}

fn code(baked: &Baked) -> ExitCode {
    if baked.is_interrupted { ExitCode::from(3) } else { ExitCode::SUCCESS }
}

/// Memory beside the scene.
fn memory(bake: &Bake, loaded: &LoadedScene) -> Budget {
    let views = loaded.views();
    bake::budget(&views.scene(loaded.camera_or_default()), bake.memory)
}

/// Checks that a whole bake has an output: maps and probes are no text.
fn check_outputs(bake: &Bake, flag: &str, example: &str) -> Result<(), Failure> {
    match bake.output.is_empty() && !bake.parts.is_part() {
        true => {
            Err(Failure::new(format!("{flag} has no output")).advice(format!("name one, as in {example}")))
        }
        false => Ok(()),
    }
}
