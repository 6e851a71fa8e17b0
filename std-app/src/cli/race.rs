//! `halflight race`: several methods on one scene for the same time, and a report that lays them side by side.

use super::failure::Failure;
use super::interrupt::{self, INTERRUPT};
use super::outputs::Outputs;
use super::progress::Teller;
use super::racer::{self, Racer};
use super::shot::{self, Options, Shot};
use super::{values, warn};
use clap::Args;
use core::sync::atomic::Ordering;
use halflight::compare::{Comparison, compare};
use halflight::drive::{self, Progress, RenderResult, Settings, Stop, Turns};
use halflight::load;
use halflight::report::{self, Maker, Run, words::readable_seconds};
use halflight_core::scene::Scene;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Compare methods on a scene: the error of each against run time
///
/// All methods render for the same time, on all threads, in turns, round by round, so that other load of the
/// machine slows all of them. Errors are measured against --reference, or estimated. Ctrl-C ends the race early;
/// it then exits with 3.
#[derive(Args)]
pub(super) struct Race {
    /// The scene: a mesh (.obj) or a scene file (.toml)
    scene: PathBuf,
    /// Methods, as in path,path:max-depth=2: a method of `render`, then options, which are its flags without dashes
    /// and win over those of the race
    #[arg(long, value_name = "METHOD[:OPTION=VALUE]...,...", value_parser = racer::racer, value_delimiter = ',',
        required = true, display_order = 1)]
    methods: Vec<Racer>,
    /// Time of rendering for each method, as in 30s, 2m, 1h
    #[arg(long, value_name = "TIME", value_parser = values::duration, display_order = 5)]
    time: f64,
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    shot: Shot,

    /// Write a report into this folder: index.html, a page that needs no other file, curve.csv and run.json
    #[arg(long, value_name = "DIR", display_order = 10)]
    report: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

/// A picture of the race.
struct Done {
    result: RenderResult,
    comparison: Option<Comparison>,
}

impl Race {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        self.check_names()?;
        let mut outputs = Outputs::new(self.json);
        self.report.iter().try_for_each(|folder| outputs.plan_report(folder))?;
        outputs.spare(&self.scene)?;
        self.shot.reference_file().map_or(Ok(()), |reference| outputs.spare(reference))?;
        let reference = self.shot.reference()?;

        let loading = Instant::now();
        let loaded = load::load(&self.scene, &self.shot.load_options(reference.as_deref()))?;
        let load_seconds = loading.elapsed().as_secs_f64();
        loaded.files.iter().try_for_each(|file| outputs.spare(file))?;
        for repair in &loaded.repairs {
            warn(repair);
        }
        let stop = Stop { seconds: Some(self.time), ..Stop::default() };
        let settings = |racer: &Racer| -> Result<Settings, Failure> {
            let options = racer.options.over(&self.options);
            self.shot.settings(&loaded, racer.method, &options, stop, reference.clone())
        };
        let all = self.methods.iter().map(settings).collect::<Result<Vec<_>, _>>()?;
        let views = loaded.views();
        let scene = views.scene(self.shot.view.camera(&loaded)?);

        interrupt::listen()?;
        let results = self.renders(&scene, &all)?;
        let (maker, name) = (Maker::here(), shot::name(&self.scene));
        let racers = self.methods.iter().zip(&all).zip(&results).map(|((racer, settings), done)| {
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
                maker: &maker,
            };
            report::Racer { name: racer.name.clone(), run }
        });
        let race = report::Race { racers: racers.collect(), seconds: self.time, maker: &maker };
        let early = INTERRUPT.load(Ordering::Relaxed);
        let reported = self.report.as_deref().filter(|folder| outputs.report(folder, &race.files()));
        let results = if self.json { race.object().to_string() } else { self.text(&race, reported) };
        Ok(outputs.end(&results, if early { ExitCode::from(3) } else { ExitCode::SUCCESS }))
    }

    /// The pictures of all methods, made in turns.
    fn renders(&self, scene: &Scene, settings: &[Settings]) -> Result<Vec<Done>, Failure> {
        let turns = Turns::new(settings.len());
        let teller = Mutex::new(Teller::new());
        let render = |index: usize| {
            let turn = turns.join(index);
            let tell = &mut |progress: &Progress| {
                let mut teller = teller.lock().unwrap_or_else(PoisonError::into_inner);
                teller.tell_of(&self.methods[index].name, progress);
                drop(teller);
                turn.pass(progress.seconds);
            };
            drive::render(scene, &settings[index], tell, &INTERRUPT)
        };
        let results: Vec<_> = std::thread::scope(|scope| {
            let started: Vec<_> =
                (0..settings.len()).map(|index| scope.spawn(move || render(index))).collect();
            started
                .into_iter()
                .map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)))
                .collect()
        });
        teller.into_inner().unwrap_or_else(PoisonError::into_inner).end();
        let done = results.into_iter().zip(settings).map(|(result, settings)| {
            let result = result.map_err(|error| shot::explain(&self.scene, &error))?;
            let comparison = settings.reference.as_ref().map(|r| compare(&result.image, r)).transpose()?;
            Ok(Done { result, comparison })
        });
        done.collect()
    }

    /// Two curves of one name could not be told apart.
    fn check_names(&self) -> Result<(), Failure> {
        let names: Vec<_> = self.methods.iter().map(|racer| racer.name.as_str()).collect();
        match names.iter().enumerate().find(|(index, name)| names[..*index].contains(name)) {
            Some((_, name)) => Err(Failure::new(format!("{name} is in the race twice"))
                .advice("give one of them another option, as in path:seed=1")),
            None => Ok(()),
        }
    }

    /// The lines for a person.
    fn text(&self, race: &report::Race, reported: Option<&Path>) -> String {
        let width = race.racers.iter().map(|racer| racer.name.chars().count()).max().unwrap_or(0).max(6);
        let mut lines = Vec::new();
        if let Some(folder) = reported {
            lines.push(format!("report {}", folder.join("index.html").display()));
        }
        let truth = if race.has_reference() { "against the reference" } else { "as estimated" };
        lines.push(format!("errors {truth}, {} of rendering each", readable_seconds(self.time)));
        lines.push(format!(
            "{:<width$}  {:>8}  {:>10}  {:>10}  {:>8}  95 % interval",
            "method", "spp", "relMSE", "efficiency", "ratio"
        ));
        for (index, racer) in race.racers.iter().enumerate() {
            let known = |value: Option<String>| value.unwrap_or("-".into());
            let ratio = race.ratio(index);
            let interval = ratio.and_then(|ratio| ratio.interval);
            let line = format!(
                "{:<width$}  {:>8}  {:>10}  {:>10}  {:>8}  {}",
                racer.name,
                racer.run.result.spp,
                known(race.error(index).map(|error| format!("{error:.3e}"))),
                known(race.efficiency(index).map(|efficiency| format!("{efficiency:.3e}"))),
                known(ratio.map(|ratio| format!("{:.3}", ratio.value))),
                interval.map_or(String::new(), |[lower, upper]| format!("{lower:.3} to {upper:.3}")),
            );
            lines.push(line.trim_end().to_owned());
        }
        for lead in race.leads() {
            let who = lead.who.map_or("too close to tell", |who| &race.racers[who].name);
            lines.push(format!(
                "ahead  {} to {}: {who}",
                readable_seconds(lead.from),
                readable_seconds(lead.to)
            ));
        }
        lines.join("\n")
    }
}
