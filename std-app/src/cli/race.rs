//! `halflight race`: several methods on one scene for the same time.

use super::failure::Failure;
use super::interrupt::{self, INTERRUPT};
use super::outputs::Outputs;
use super::picture_args::{MethodArgs, PictureArgs, file_name, note_darkness, render_failure};
use super::progress::ProgressReporter;
use super::race_entry::{RaceEntry, race_entry};
use super::{print_note, values};
use clap::Args;
use core::sync::atomic::Ordering;
use halflight::compare::{Comparison, compare};
use halflight::load;
use halflight::pool::{ThreadPoolBuildError, in_pool};
use halflight::quantity::readable_seconds;
use halflight::render::{self, FairSchedule, Progress, RenderError, RenderResult, Settings, Stop, Turn};
use halflight::report::{self, Provenance, Run};
use halflight_core::scene::Scene;
use std::io;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::thread::{self, ScopedJoinHandle};
use std::time::Instant;

/// Compare the error of several methods against run time
///
/// The methods render in turns, round by round, each on all threads and for the same time, so other load of
/// the machine affects all of them. Errors are measured against --reference, or estimated. Ctrl-C ends the
/// race early with exit code 3.
#[derive(Args)]
pub(super) struct Race {
    /// Scene: a mesh (.obj), glTF (.glb, .gltf) or a scene file (.toml)
    scene: PathBuf,
    /// Methods of `render`, each with options after colons, as in path,path:max-depth=2; an option is a flag
    /// below without dashes, and wins over the flag of the race
    #[arg(long, value_name = "METHOD[:OPTION[=VALUE]]...,...", value_parser = race_entry, value_delimiter = ',',
        required = true, display_order = 1)]
    methods: Vec<RaceEntry>,
    /// Rendering time of each method, as in 30s, 2m, 1h
    #[arg(long, value_name = "TIME", value_parser = values::duration, display_order = 5)]
    time: f64,
    #[command(flatten)]
    method_args: MethodArgs,
    #[command(flatten)]
    picture: PictureArgs,

    /// Write a report into this folder: index.html, curve.csv and run.json
    #[arg(long, value_name = "DIR", display_order = 10)]
    report: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

/// Picture of a method.
struct Done {
    result: RenderResult,
    comparison: Option<Comparison>,
}

impl Race {
    /// Number of threads; `None`: all of the machine.
    pub(super) fn threads(&self) -> Option<usize> {
        self.picture.threads()
    }

    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        self.check_names()?;
        let mut outputs = Outputs::new(self.json);
        self.report.iter().try_for_each(|folder| outputs.plan_report(folder))?;
        outputs.protect(&self.scene)?;
        self.picture.reference_file().map_or(Ok(()), |reference| outputs.protect(reference))?;
        let reference = self.picture.reference()?;

        let loading = Instant::now();
        let loaded = load::load(&self.scene, &self.picture.load_options(reference.as_deref()))?;
        let load_seconds = loading.elapsed().as_secs_f64();
        loaded.files.iter().try_for_each(|file| outputs.protect(file))?;
        loaded.repairs.iter().for_each(print_note);
        let stop = Stop { seconds: Some(self.time), ..Stop::default() };
        let settings = |entry: &RaceEntry| {
            let args = entry.args(&self.method_args)?;
            self.picture.settings(&loaded, entry.method, &args, stop, reference.clone())
        };
        let all = self.methods.iter().map(settings).collect::<Result<Vec<_>, _>>()?;
        let views = loaded.views();
        let scene = views.scene(self.picture.camera.camera(&loaded)?);
        note_darkness(&scene);

        interrupt::install_handler()?;
        let results = self.renders(&scene, &all)?;
        let (provenance, name) = (Provenance::here(), file_name(&self.scene));
        let entries = self.methods.iter().zip(&all).zip(&results).map(|((entry, settings), done)| {
            let seconds = &done.result.seconds;
            let run = Run {
                scene: &scene,
                name: &name,
                repairs: &loaded.repairs,
                settings,
                result: &done.result,
                comparison: done.comparison.as_ref(),
                outputs: &[],
                load_seconds,
                total_seconds: load_seconds + seconds.build + seconds.render,
                provenance: &provenance,
            };
            report::RaceEntry { name: entry.name.clone(), run }
        });
        let race = report::Race { entries: entries.collect(), seconds: self.time, provenance: &provenance };
        let is_early = INTERRUPT.load(Ordering::Relaxed);
        let reported = self.report.as_deref().filter(|folder| outputs.save_report(folder, &race.files()));
        let code = if is_early { ExitCode::from(3) } else { ExitCode::SUCCESS };
        Ok(outputs.end_with(|| race.object(), || self.text(&race, reported), code))
    }

    /// Pictures of all methods, rendered in turns.
    fn renders(&self, scene: &Scene, settings: &[Settings]) -> Result<Vec<Done>, Failure> {
        let schedule = FairSchedule::new(settings.len());
        let reporter = Mutex::new(ProgressReporter::new());
        let render = |index: usize, turn: &Turn| {
            let progress = &mut |progress: &Progress| {
                let mut reporter = reporter.lock().unwrap_or_else(PoisonError::into_inner);
                reporter.report(&self.methods[index].name, progress);
                drop(reporter);
                turn.pass(progress.seconds);
            };
            render::render(scene, &settings[index], progress, &INTERRUPT)
        };
        let run = |index: usize| {
            let turn = schedule.join(index);
            let refused = |error: ThreadPoolBuildError| Err(RenderError::Threads(error.to_string()));
            in_pool(self.threads(), || render(index, &turn)).unwrap_or_else(refused)
        };
        let run = &run;
        let results: Vec<_> = thread::scope(|scope| {
            let spawn = |index| thread::Builder::new().spawn_scoped(scope, move || run(index));
            let started: Vec<_> = (0..settings.len()).map(spawn).collect();
            // The others wait for the turn of a render without a thread.
            for (index, _) in started.iter().enumerate().filter(|(_, started)| started.is_err()) {
                INTERRUPT.store(true, Ordering::Relaxed);
                drop(schedule.join(index));
            }
            let end = |started: io::Result<ScopedJoinHandle<_>>| match started {
                Ok(thread) => thread.join().unwrap_or_else(|panic| resume_unwind(panic)),
                Err(error) => Err(RenderError::Threads(error.to_string())),
            };
            started.into_iter().map(end).collect()
        });
        reporter.into_inner().unwrap_or_else(PoisonError::into_inner).end();
        let done = results.into_iter().zip(settings).map(|(result, settings)| {
            let result = result.map_err(|error| render_failure(&self.scene, &error))?;
            let comparison = settings.reference.as_ref().map(|r| compare(&result.image, r)).transpose()?;
            Ok(Done { result, comparison })
        });
        done.collect()
    }

    /// Refuses two methods of one name, whose curves would look alike.
    fn check_names(&self) -> Result<(), Failure> {
        let names: Vec<_> = self.methods.iter().map(|entry| entry.name.as_str()).collect();
        match names.iter().enumerate().find(|(index, name)| names[..*index].contains(name)) {
            Some((_, name)) => Err(Failure::new(format!("{name} is in the race twice"))
                .advice("give one of them another option, as in path:seed=1")),
            None => Ok(()),
        }
    }

    fn text(&self, race: &report::Race, report: Option<&Path>) -> String {
        let width = race.entries.iter().map(|entry| entry.name.chars().count()).max().unwrap_or(0).max(6);
        let mut lines = Vec::new();
        lines.extend(report.map(|folder| format!("report {}", folder.join("index.html").display())));
        let source = if race.has_reference() { "against the reference" } else { "estimated" };
        let early = if INTERRUPT.load(Ordering::Relaxed) { ", stopped early" } else { "" };
        lines.push(format!("errors {source}, {} of rendering each{early}", readable_seconds(self.time)));
        let row = |cells: [String; 6]| {
            let [name, spp, error, efficiency, ratio, interval] = cells;
            let line =
                format!("{name:<width$}  {spp:>8}  {error:>10}  {efficiency:>10}  {ratio:>8}  {interval}");
            line.trim_end().to_owned()
        };
        let head = ["method", "spp", "relMSE", "efficiency", "ratio", "95 % interval"];
        lines.push(row(head.map(String::from)));
        for (index, entry) in race.entries.iter().enumerate() {
            let scientific = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.3e}"));
            let ratio = race.ratio(index);
            let interval = ratio.and_then(|ratio| ratio.interval);
            lines.push(row([
                entry.name.clone(),
                entry.run.result.spp.to_string(),
                scientific(race.error(index)),
                scientific(race.efficiency(index)),
                ratio.map_or("-".into(), |ratio| format!("{:.3}", ratio.value)),
                interval.map_or(String::new(), |[lower, upper]| format!("{lower:.3} to {upper:.3}")),
            ]));
        }
        lines.extend(race.leads().iter().map(|lead| {
            let leader = lead.leader.map_or("no clear leader", |leader| &race.entries[leader].name);
            format!("leader {} to {}: {leader}", readable_seconds(lead.from), readable_seconds(lead.to))
        }));
        lines.join("\n")
    }
}
