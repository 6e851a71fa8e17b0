//! `halflight render`: from a scene and flags to pictures in files and a report of their error.

use super::failure::Failure;
use super::progress::Teller;
use super::report::Report;
use super::values;
use super::view::View;
use super::{say, warn};
use clap::{Args, ValueEnum};
use core::sync::atomic::{AtomicBool, Ordering};
use halflight::compare::compare;
use halflight::drive::{self, Ending, Settings, Stop};
use halflight::load::{self, LoadOptions, LoadedScene};
use halflight::save::{self, Image};
use halflight_simd::{Level, Tier};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Render a scene to pictures
///
/// Stops at the first of --spp, --time and --error that holds; flags win over the scene file, and any of
/// these three replaces all three of it. Ctrl-C stops early, saves what there is and exits with 3.
#[derive(Args)]
pub(super) struct Render {
    /// The scene: a mesh (.obj) or a scene file (.toml)
    scene: PathBuf,
    /// Where the picture goes (.png, .exr, .hdr or .pfm); may be given several times [default: the name of
    /// the scene with .png, in the current folder]
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Width and height in pixels [default: 512x512]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    size: Option<[u32; 2]>,
    /// How light is transported
    #[arg(long, default_value = "auto")]
    method: Method,
    /// Whether caustics get a map of their own where they need one; `path` never needs one
    #[arg(long, default_value = "auto")]
    caustics: Caustics,
    /// Longest path in segments: 1 is light seen directly, 2 adds direct light [default: no limit]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    max_depth: Option<u32>,

    #[command(flatten)]
    view: View,

    /// Samples per pixel [default: 256, where no other rule is given]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 30),
        help_heading = "When to stop")]
    spp: Option<u32>,
    /// Time of rendering, as in 30s, 2m, 1h
    #[arg(long, value_name = "TIME", value_parser = values::duration, help_heading = "When to stop")]
    time: Option<f64>,
    /// relMSE: stop when the upper end of its interval is below
    #[arg(long, value_name = "RELMSE", value_parser = values::positive, help_heading = "When to stop")]
    error: Option<f64>,

    /// Another seed, another noise [default: 0]
    #[arg(long, value_name = "N", help_heading = "How to run")]
    seed: Option<u32>,
    /// Threads [default: all that the machine runs at once]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096),
        help_heading = "How to run")]
    threads: Option<u32>,
    /// Most memory for the scene and all structures, as in 512M or 2G [default: no limit]
    #[arg(long, value_name = "BYTES", value_parser = values::bytes, help_heading = "How to run")]
    memory: Option<usize>,
    /// Highest instruction set to use: baseline, avx2 or avx512 [default: the processor's]
    #[arg(long, value_name = "LEVEL", value_parser = values::tier, help_heading = "How to run")]
    simd: Option<Tier>,
    /// The same bits on every processor: the instruction set that all have
    #[arg(long, help_heading = "How to run")]
    precise: bool,

    /// A reference picture of the same size; the error against it is reported
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    reference: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Method {
    /// What fits the scene; today, path
    Auto,
    /// Path tracing with next-event estimation and multiple importance sampling
    Path,
}

#[derive(Clone, Copy, ValueEnum)]
enum Caustics {
    /// Where the method needs it
    Auto,
    /// Never
    Off,
}

/// Raised by Ctrl-C.
static INTERRUPT: AtomicBool = AtomicBool::new(false);

impl Render {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let start = Instant::now();
        // Both are the same for path tracing, the only method there is.
        let (Method::Auto | Method::Path, Caustics::Auto | Caustics::Off) = (self.method, self.caustics);
        let outputs = self.outputs();
        for output in &outputs {
            save::check_writable(output)?;
        }
        let reference = self.reference.as_deref().map(save::read).transpose()?;

        let loading = Instant::now();
        let loaded = load::load(&self.scene, &LoadOptions::default())?;
        let load_seconds = loading.elapsed().as_secs_f64();
        for repair in &loaded.repairs {
            warn(repair);
        }
        let settings = self.settings(&loaded)?;
        self.check_reference(reference.as_ref(), &settings)?;
        let views = loaded.views();
        let scene = views.scene(self.view.camera(&loaded)?);

        listen_for_interrupts()?;
        let mut teller = Teller::new();
        let result = drive::render(&scene, &settings, &mut |progress| teller.tell(progress), &INTERRUPT);
        teller.end();
        let result = result.map_err(|error| self.explain(error))?;

        for output in &outputs {
            save::write(output, &result.image)?;
        }
        let comparison = match &reference {
            Some(reference) => Some(compare(&result.image, reference)?),
            None => None,
        };
        let report = Report {
            scene: &scene,
            settings: &settings,
            result: &result,
            comparison: comparison.as_ref(),
            outputs: &outputs,
            load_seconds,
            total_seconds: start.elapsed().as_secs_f64(),
        };
        say(&if self.json { report.object().to_string() } else { report.text() });
        Ok(match result.ending {
            Ending::Done => ExitCode::SUCCESS,
            Ending::Interrupted => ExitCode::from(3),
        })
    }

    fn outputs(&self) -> Vec<PathBuf> {
        if self.output.is_empty() {
            let name = self.scene.file_stem().unwrap_or("picture".as_ref());
            let mut name = PathBuf::from(name).into_os_string();
            name.push(".png");
            return vec![name.into()];
        }
        self.output.clone()
    }

    fn settings(&self, loaded: &LoadedScene) -> Result<Settings, Failure> {
        let file = &loaded.settings;
        if let Some(method) = file.method.as_deref()
            && Method::from_str(method, true).is_err()
        {
            return Err(Failure::new(format!("{}: there is no method `{method}`", self.scene.display()))
                .advice("the methods are auto and path"));
        }
        let flags = Stop { spp: self.spp, seconds: self.time, error: self.error };
        let rules = Stop { spp: file.spp, seconds: file.time, error: file.error };
        let defaults = Settings::default();
        let [width, height] = self.size.or(file.size).unwrap_or([defaults.width, defaults.height]);
        let level = if self.precise { Level::BASELINE } else { Level::detect() };
        Ok(Settings {
            width,
            height,
            seed: self.seed.or(file.seed).unwrap_or(defaults.seed),
            max_depth: self.max_depth.or(file.max_depth),
            threads: self.threads.map(|threads| threads as usize),
            memory: self.memory,
            level: self.simd.map_or(level, |tier| level.capped(tier)),
            stop: if flags == Stop::default() { rules } else { flags },
        })
    }

    /// Before the render, not after it.
    fn check_reference(&self, reference: Option<&Image>, settings: &Settings) -> Result<(), Failure> {
        let (Some(file), Some(reference)) = (&self.reference, reference) else { return Ok(()) };
        if (reference.width, reference.height) == (settings.width, settings.height) {
            return Ok(());
        }
        let Image { width, height, .. } = reference;
        let asked = format!("{}x{}", settings.width, settings.height);
        Err(Failure::new(format!("{} has {width}x{height} pixels, the render {asked}", file.display()))
            .advice(format!("render with --size {width}x{height}; nothing is resampled")))
    }

    fn explain(&self, error: drive::RenderError) -> Failure {
        let failure = Failure::new(format!("{}: {error}", self.scene.display()));
        match error {
            drive::RenderError::Memory { needed, .. } => failure.advice(format!(
                "{} are needed: raise --memory, or lower --size or --threads",
                values::readable_bytes(needed)
            )),
            _ => failure,
        }
    }
}

/// The first Ctrl-C (or SIGTERM) ends the render with what there is, the second the program.
fn listen_for_interrupts() -> Result<(), Failure> {
    let heard = || {
        if INTERRUPT.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        warn("stopping; once more to stop at once, without a picture");
    };
    ctrlc::set_handler(heard).map_err(|error| Failure::new(format!("Ctrl-C cannot be listened for: {error}")))
}
