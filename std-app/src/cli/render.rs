//! `halflight render`: from a scene and flags to pictures in files and a report of their error.

use super::failure::Failure;
use super::interrupt::{self, INTERRUPT};
use super::method::{self, Choice};
use super::outputs::{Outputs, Role};
use super::progress::Teller;
use super::shot::{self, Options, Shot};
use super::{summary, values, warn};
use clap::{Args, ValueEnum};
use halflight::compare::compare;
use halflight::drive::{self, Checkpoint, Ending, Settings, Shard, Stop};
use halflight::load::{self, LoadedScene};
use halflight::report::{Maker, Run};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Render a scene to pictures
///
/// The render stops when the first of --spp, --time and --error is reached. Flags win over the scene file; any of
/// these three replaces all three of it. Ctrl-C stops early, saves the picture and exits with 3.
#[derive(Args)]
pub(super) struct Render {
    /// The scene: a mesh (.obj) or a scene file (.toml)
    scene: PathBuf,
    /// File of the picture: .png, .exr, .hdr or .pfm; may be given several times [default: the name of the
    /// scene with .png, in the current folder]
    #[arg(short, long, value_name = "FILE", display_order = 1)]
    output: Vec<PathBuf>,
    /// Method of light transport
    #[arg(long, default_value = "auto", display_order = 2)]
    method: Choice,
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    shot: Shot,

    /// Samples per pixel [default: 256 without --time and --error]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 30),
        display_order = 4)]
    spp: Option<u32>,
    /// Time of rendering, as in 30s, 2m, 1h
    #[arg(long, value_name = "TIME", value_parser = values::duration, display_order = 5)]
    time: Option<f64>,
    /// Stop when the 95 % upper bound of relMSE falls to this value
    #[arg(long, value_name = "RELMSE", value_parser = values::positive, display_order = 6)]
    error: Option<f64>,

    /// Keep the film in a file during the render, for --resume and `halflight merge`
    #[arg(long, value_name = "FILE", help_heading = "In parts")]
    checkpoint: Option<PathBuf>,
    /// Time between two checkpoints; the last one is written at the end [default: 60s]
    #[arg(long, value_name = "TIME", value_parser = values::duration, requires = "checkpoint",
        help_heading = "In parts")]
    checkpoint_every: Option<f64>,
    /// Continue the film of a checkpoint; all flags must be the same, except --spp, --time and --error
    #[arg(long, value_name = "FILE", help_heading = "In parts")]
    resume: Option<PathBuf>,
    /// Render part I of N, counted from 1, into the film of --checkpoint, for `halflight merge`; without -o no
    /// picture is written
    #[arg(long, value_name = "I/N", value_parser = values::shard, requires = "checkpoint",
        conflicts_with_all = ["time", "error"], help_heading = "In parts")]
    shard: Option<Shard>,

    /// Start with the irradiance caches of a file: same scene and settings, any view
    #[arg(long, value_name = "FILE", help_heading = "Irradiance cache")]
    load_cache: Option<PathBuf>,
    /// Write the irradiance caches to a file when they are filled, for --load-cache
    #[arg(long, value_name = "FILE", help_heading = "Irradiance cache")]
    save_cache: Option<PathBuf>,

    /// Write a report into this folder: index.html, a page that needs no other file, curve.csv and run.json
    #[arg(long, value_name = "DIR", display_order = 10)]
    report: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

/// Points at which a report holds irradiance caches against exact values, about.
const SURVEY: u32 = 1000;

impl Render {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let start = Instant::now();
        let (role, pictures) = self.pictures();
        let mut outputs = self.outputs(role, &pictures)?;
        let reference = self.shot.reference()?;

        let loading = Instant::now();
        let loaded = load::load(&self.scene, &self.shot.load_options(reference.as_deref()))?;
        let load_seconds = loading.elapsed().as_secs_f64();
        loaded.files.iter().try_for_each(|file| outputs.spare(file))?;
        for repair in &loaded.repairs {
            warn(repair);
        }
        self.check_method(&loaded)?;
        let settings =
            self.shot.settings(&loaded, self.method, &self.options, self.stop(&loaded)?, reference)?;
        let every = self.checkpoint_every.unwrap_or(Checkpoint::EVERY);
        let settings = Settings {
            shard: self.shard.unwrap_or(Shard::WHOLE),
            checkpoint: self.checkpoint.clone().map(|path| Checkpoint { path, every }),
            resume: self.resume.clone(),
            load_cache: self.load_cache.clone(),
            save_cache: self.save_cache.clone(),
            survey: self.report.is_some().then_some(SURVEY),
            photon_view: self.report.is_some(),
            ..settings
        };
        let views = loaded.views();
        let scene = views.scene(self.shot.view.camera(&loaded)?);

        interrupt::listen()?;
        let mut teller = Teller::new();
        let result = drive::render(&scene, &settings, &mut |progress| teller.tell(progress), &INTERRUPT);
        teller.end();
        let result = result.map_err(|error| shot::explain(&self.scene, &error))?;

        result.unsaved.iter().for_each(|error| outputs.fail(error.clone()));
        let saved: Vec<_> = outputs.save_to(&pictures, &result.image).into_iter().cloned().collect();
        let comparison = match &settings.reference {
            Some(reference) => Some(compare(&result.image, reference)?),
            None => None,
        };
        let maker = Maker::here();
        let run = Run {
            scene: &scene,
            name: &shot::name(&self.scene),
            repairs: &loaded.repairs,
            settings: &settings,
            result: &result,
            comparison: comparison.as_ref(),
            outputs: &saved,
            load_seconds,
            total_seconds: start.elapsed().as_secs_f64(),
            maker: &maker,
        };
        let reported = self.report.as_deref().filter(|folder| outputs.report(folder, &run.files()));
        let results = if self.json { run.object().to_string() } else { summary::text(&run, reported) };
        let code = match result.ending {
            Ending::Done => ExitCode::SUCCESS,
            Ending::Interrupted | Ending::Biased | Ending::NoiseFloor => ExitCode::from(3),
        };
        Ok(outputs.end(&results, code))
    }

    /// All that is going to be written, where it can be and is nothing that is read; the files of the scene are not
    /// known yet.
    fn outputs(&self, role: Role, pictures: &[PathBuf]) -> Result<Outputs, Failure> {
        let mut outputs = Outputs::new(self.json);
        pictures.iter().try_for_each(|picture| outputs.plan(role, picture))?;
        self.checkpoint.iter().try_for_each(|film| outputs.plan(Role::Checkpoint, film))?;
        self.save_cache.iter().try_for_each(|cache| outputs.plan(Role::Cache, cache))?;
        self.report.iter().try_for_each(|folder| outputs.plan_report(folder))?;
        outputs.spare(&self.scene)?;
        self.shot.reference_file().map_or(Ok(()), |reference| outputs.spare(reference))?;
        self.resume.iter().try_for_each(|film| outputs.spare_but(film, Role::Checkpoint))?;
        self.load_cache.iter().try_for_each(|cache| outputs.spare_but(cache, Role::Cache))?;
        Ok(outputs)
    }

    /// Where the picture goes, and whether a flag says so.
    fn pictures(&self) -> (Role, Vec<PathBuf>) {
        if self.output.is_empty() && self.shard.is_some() {
            return (Role::Default, Vec::new());
        }
        if self.output.is_empty() {
            let name = self.scene.file_stem().unwrap_or("picture".as_ref());
            let mut name = PathBuf::from(name).into_os_string();
            name.push(".png");
            return (Role::Default, vec![name.into()]);
        }
        (Role::Picture, self.output.clone())
    }

    /// The method that the scene file asks for.
    fn check_method(&self, loaded: &LoadedScene) -> Result<(), Failure> {
        match loaded.settings.method.as_deref() {
            Some(method) if Choice::from_str(method, true).is_err() => {
                Err(Failure::new(format!("{}: there is no method `{method}`", self.scene.display()))
                    .advice(format!("the methods are {}", method::names())))
            }
            _ => Ok(()),
        }
    }

    fn stop(&self, loaded: &LoadedScene) -> Result<Stop, Failure> {
        let file = &loaded.settings;
        let flags = Stop { spp: self.spp, seconds: self.time, error: self.error };
        let rules = Stop { spp: file.spp, seconds: file.time, error: file.error };
        let stop = if flags == Stop::default() { rules } else { flags };
        if self.shard.is_some() && (stop.seconds.is_some() || stop.error.is_some()) {
            let why = "the scene file stops by time or error, but shards must have the same samples";
            return Err(Failure::new(format!("{}: {why}", self.scene.display())).advice("say --spp N"));
        }
        Ok(stop)
    }
}
