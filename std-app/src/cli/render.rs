//! `halflight render`: pictures of a scene, with an estimate of their error.

use super::checkpoint_args::CheckpointArgs;
use super::crop_args::CropArgs;
use super::failure::Failure;
use super::interrupt::{self, INTERRUPT};
use super::layer_args::LayerArgs;
use super::live_args::LiveArgs;
use super::outputs::{Outputs, Picture, Role};
use super::picture_args::{MethodArg, MethodArgs, PictureArgs, file_name, note_darkness, render_failure};
use super::progress::{ProgressArgs, ProgressReporter};
use super::view_args::ViewArgs;
use super::{print_note, summary, values};
use clap::Args;
use halflight::compare::compare;
use halflight::layers::{Facts, LayerSource};
use halflight::load::{self, LoadedScene};
use halflight::render::{self, Ending, Progress, Settings, Shard, Stop};
use halflight::report::{Provenance, Run};
use halflight::save::{ExrFile, Image};
use halflight::values::{Samples, TargetError};
use halflight_core::scene::Camera;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

/// Render a scene to pictures
///
/// The first of --spp, --time and --error that holds ends the render. Flags win over the scene file; any of
/// these three replaces all three of it. Ctrl-C ends the render early with a valid picture and exit code 3.
#[derive(Args)]
pub(super) struct Render {
    /// Scene: a mesh (.obj), glTF (.glb, .gltf) or a scene file (.toml)
    scene: PathBuf,
    /// Picture: .png, .exr, .hdr or .pfm; may be repeated [default: name of the scene with .png, in the
    /// current folder]
    #[arg(short, long, value_name = "FILE", display_order = 1)]
    output: Vec<PathBuf>,
    /// Method of light transport
    #[arg(long, default_value = "auto", display_order = 2)]
    method: MethodArg,
    #[command(flatten)]
    method_args: MethodArgs,
    #[command(flatten)]
    picture: PictureArgs,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    live: LiveArgs,
    #[command(flatten)]
    progress: ProgressArgs,
    #[command(flatten)]
    layers: LayerArgs,

    /// Samples per pixel. Without --spp, --time and --error a render ends at relMSE 1e-3 or after 60 s; a
    /// shard has 256 samples
    #[arg(long, value_name = "N", value_parser = values::checked::<u32, Samples>, display_order = 4)]
    spp: Option<Samples>,
    /// Rendering time, as in 30s, 2m, 1h
    #[arg(long, value_name = "TIME", value_parser = values::duration, display_order = 5)]
    time: Option<f64>,
    /// Stop when the 95 % upper bound of relMSE falls to this value
    #[arg(long, value_name = "RELMSE", value_parser = values::checked::<f64, TargetError>, display_order = 6)]
    error: Option<TargetError>,

    #[command(flatten)]
    checkpoint: CheckpointArgs,
    /// Render every Nth tile from the Ith on into the film of --checkpoint; a picture only with -o
    #[arg(long, value_name = "I/N", value_parser = values::shard, requires = "kept",
        conflicts_with_all = ["time", "error"], help_heading = "Parts")]
    shard: Option<Shard>,
    #[command(flatten)]
    crop: CropArgs,

    /// Start from the irradiance caches of a file: same scene and settings, any view
    #[arg(long, value_name = "FILE", help_heading = "Irradiance cache")]
    load_cache: Option<PathBuf>,
    /// Write the filled irradiance caches to a file, for --load-cache
    #[arg(long, value_name = "FILE", help_heading = "Irradiance cache")]
    save_cache: Option<PathBuf>,

    /// Write a report into this folder: index.html, curve.csv and run.json
    #[arg(long, value_name = "DIR", display_order = 10)]
    report: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

/// Number of test points of an irradiance cache in a report, about.
const SURVEY_POINTS: u32 = 1000;

impl Render {
    /// Number of threads; `None`: all of the machine.
    pub(super) fn threads(&self) -> Option<usize> {
        self.picture.threads()
    }

    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        self.progress.apply();
        let start = Instant::now();
        let (role, pictures) = self.pictures();
        self.layers.check(&pictures)?;
        let mut outputs = self.outputs(role, &pictures)?;
        let reference = self.picture.reference()?;

        let loading = Instant::now();
        let loaded = load::load(&self.scene, &self.picture.load_options(reference.as_deref()))?;
        let load_seconds = loading.elapsed().as_secs_f64();
        loaded.files.iter().try_for_each(|file| outputs.protect(file))?;
        loaded.repairs.iter().for_each(print_note);
        let (stop, by_default) = self.stop(&loaded)?;
        let views = loaded.views();
        let scene = views.scene(self.camera(&loaded)?);
        let (stop, by_default) = match note_darkness(&scene) {
            true => (Stop { spp: stop.spp.or(Some(1)), ..stop }, false),
            false => (stop, by_default),
        };
        let settings = self.settings(&loaded, stop, reference)?;

        interrupt::install_handler()?;
        let (mut reporter, mut live) = (ProgressReporter::new(), self.live.live(&self.view));
        let mut report = |progress: &Progress| {
            reporter.report("", progress);
            live.show(progress);
        };
        let result = render::render(&scene, &settings, &mut report, &INTERRUPT);
        reporter.end();
        let result = result.map_err(|error| render_failure(&self.scene, &error))?;

        result.unsaved.iter().for_each(|error| outputs.fail(error.clone()));
        live.put(&result.image);
        let shown = self.view.shown(&result.image, &pictures);
        let (name, provenance) = (file_name(&self.scene), Provenance::here());
        let layers = LayerSource::new(&result, &loaded);
        self.layers.note_missing(&layers);
        let exr = || {
            let mut file = ExrFile::of(&result.image);
            Facts::of_render(&result, (&name, &settings), &provenance).add_to(&mut file);
            self.layers.add_to(&mut file, &layers);
            file
        };
        let picture = Picture { image: &result.image, shown: &shown, exr: &exr };
        let saved: Vec<_> = outputs.save_to(&pictures, &picture).into_iter().cloned().collect();
        let comparison =
            settings.reference.as_ref().map(|reference| compare(&result.image, reference)).transpose()?;
        let run = Run {
            scene: &scene,
            name: &name,
            repairs: &loaded.repairs,
            settings: &settings,
            result: &result,
            comparison: comparison.as_ref(),
            outputs: &saved,
            load_seconds,
            total_seconds: start.elapsed().as_secs_f64(),
            provenance: &provenance,
        };
        let reported = self.report.as_deref().filter(|folder| outputs.save_report(folder, &run.files()));
        let code = match result.ending {
            Ending::Done => ExitCode::SUCCESS,
            // The user asked for no error that could be missed.
            Ending::Biased | Ending::NoiseFloor if by_default => ExitCode::SUCCESS,
            Ending::Interrupted | Ending::Biased | Ending::NoiseFloor => ExitCode::from(3),
        };
        Ok(outputs.end_with(|| run.object(), || summary::text(&run, reported, by_default), code))
    }

    /// Settings of the flags, completed by those of the scene file.
    pub(super) fn settings(
        &self,
        loaded: &LoadedScene,
        stop: Stop,
        reference: Option<Arc<Image>>,
    ) -> Result<Settings, Failure> {
        let settings = self.picture.settings(loaded, self.method, &self.method_args, stop, reference)?;
        let window = self.crop.shard([settings.width, settings.height])?;
        Ok(Settings {
            shard: self.shard.or(window).unwrap_or(Shard::WHOLE),
            checkpoint: self.checkpoint.checkpoint(),
            resume: self.checkpoint.resume(),
            load_cache: self.load_cache.clone(),
            save_cache: self.save_cache.clone(),
            survey: self.report.is_some().then_some(SURVEY_POINTS),
            layers: self.layers.settings(loaded),
            photon_view: self.report.is_some(),
            shown_bytes: self.live.bytes([settings.width, settings.height]),
            ..settings
        })
    }

    /// Camera of the flags, completed by that of the scene file.
    pub(super) fn camera(&self, loaded: &LoadedScene) -> Result<Camera, Failure> {
        self.picture.camera.camera(loaded)
    }

    /// Checked outputs. The files of the scene are not known yet.
    fn outputs(&self, role: Role, pictures: &[PathBuf]) -> Result<Outputs, Failure> {
        let mut outputs = Outputs::new(self.json);
        pictures.iter().try_for_each(|picture| outputs.plan(role, picture))?;
        self.checkpoint.plan(&mut outputs)?;
        self.live.plan(&mut outputs)?;
        self.save_cache.iter().try_for_each(|cache| outputs.plan(Role::Cache, cache))?;
        self.report.iter().try_for_each(|folder| outputs.plan_report(folder))?;
        outputs.protect(&self.scene)?;
        self.picture.reference_file().map_or(Ok(()), |reference| outputs.protect(reference))?;
        self.checkpoint.protect(&outputs)?;
        self.load_cache.iter().try_for_each(|cache| outputs.protect_except(cache, Role::Cache))?;
        Ok(outputs)
    }

    /// Files of the picture and their role.
    fn pictures(&self) -> (Role, Vec<PathBuf>) {
        match (self.output.is_empty(), self.shard.is_some()) {
            (false, _) => (Role::Picture, self.output.clone()),
            (true, true) => (Role::Default, Vec::new()),
            (true, false) => {
                let mut name = self.scene.file_stem().unwrap_or("picture".as_ref()).to_owned();
                name.push(".png");
                (Role::Default, vec![name.into()])
            }
        }
    }

    /// When to stop, and whether that is the default: neither flags nor scene file have a rule.
    pub(super) fn stop(&self, loaded: &LoadedScene) -> Result<(Stop, bool), Failure> {
        let file = &loaded.settings;
        let stop = |spp: Option<Samples>, seconds, error: Option<TargetError>| Stop {
            spp: spp.map(u32::from),
            seconds,
            error: error.map(f64::from),
        };
        let flags = stop(self.spp, self.time, self.error);
        let rules = stop(file.spp, file.time.map(f64::from), file.error);
        let stop = if flags == Stop::default() { rules } else { flags };
        if stop == Stop::default() && self.shard.is_none() {
            return Ok((Stop::SENSIBLE, true));
        }
        if self.shard.is_some() && (stop.seconds.is_some() || stop.error.is_some()) {
            let why = "the scene file stops by time or error, but shards must have the same samples";
            return Err(Failure::new(format!("{}: {why}", self.scene.display())).advice("add --spp N"));
        }
        Ok((stop, false))
    }
}
