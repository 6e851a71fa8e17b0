//! Progress on standard error: a bar on a terminal, otherwise a line every five seconds; or objects, whose
//! schema is docs/progress.schema.json.

use super::stdio::{self, Messages, escaped, print_event, print_message, print_note};
use clap::{Args, ValueEnum};
use halflight::quantity::readable_seconds;
use halflight::render::Progress;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use std::io::{IsTerminal, stderr};

/// Seconds between lines.
const INTERVAL: f64 = 5.0;

/// Steps of the bar.
const STEPS: u64 = 1000;

/// Flags of messages on standard error.
#[derive(Args)]
pub(super) struct ProgressArgs {
    /// Form of progress and notes on standard error
    #[arg(long, value_name = "FORM", default_value = "text", help_heading = "Results")]
    progress: Form,
    /// Print errors alone: neither progress nor notes nor a summary
    #[arg(short, long, conflicts_with = "progress", help_heading = "Results")]
    quiet: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Form {
    /// A bar on a terminal, otherwise a line every five seconds
    Text,
    /// An object a line, for programs
    Json,
}

impl ProgressArgs {
    /// Chooses the form of all messages of the program.
    pub(super) fn apply(&self) {
        stdio::set_messages(match (self.quiet, self.progress) {
            (true, _) => Messages::Quiet,
            (false, Form::Json) => Messages::Json,
            (false, Form::Text) => Messages::Text,
        });
    }
}

/// Reports the progress of one or several renders.
pub(super) struct ProgressReporter {
    bar: Option<ProgressBar>,
    /// Rendering seconds of the last line.
    last_line: f64,
}

impl ProgressReporter {
    pub(super) fn new() -> Self {
        let style = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}");
        let style = style.unwrap_or(ProgressStyle::default_bar());
        let has_bar = stderr().is_terminal() && !stdio::is_json() && !stdio::is_quiet();
        let bar = has_bar.then(|| ProgressBar::new(STEPS).with_style(style));
        Self { bar, last_line: 0.0 }
    }

    /// Reports `text` after so many seconds, with those that are left if they are limited. Programs get
    /// `state` in its place.
    pub(super) fn report_text(&mut self, (text, state): (&str, Value), seconds: f64, left: Option<f64>) {
        if stdio::is_json() {
            let mut object = state;
            (object["seconds"], object["seconds_left"]) = (seconds.into(), left.into());
            return print_event("progress", object);
        }
        if stdio::is_quiet() {
            return;
        }
        let done = left.map_or(0.0, |left| seconds / (seconds + left).max(1e-9));
        if let Some(bar) = &self.bar {
            bar.set_position((done * STEPS as f64) as u64);
            bar.set_message(escaped(text).into_owned());
        } else if seconds >= self.last_line + INTERVAL {
            self.last_line = seconds;
            print_message(format_args!("{:>3.0} %  {text}", 100.0 * done));
        }
    }

    /// Reports a round of the render `name`, which is empty for a single render.
    pub(super) fn report(&mut self, name: &str, progress: &Progress) {
        let separator = if name.is_empty() { "" } else { ": " };
        let text = format!("{name}{separator}{}", text(progress));
        if let Some(error) = &progress.unsaved {
            let note = || print_note(format_args!("{error}; the render continues and tries again"));
            self.bar.as_ref().map_or_else(note, |bar| bar.suspend(note));
        }
        let error = progress
            .error
            .map(|error| json!({ "relmse": error.relmse, "lower": error.lower, "upper": error.upper }));
        let state = json!({ "render": name, "samples": progress.spp, "error": error });
        self.report_text((&text, state), progress.seconds, progress.seconds_left);
    }

    /// Removes the bar.
    pub(super) fn end(self) {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
    }
}

fn text(progress: &Progress) -> String {
    let error = progress.error.map_or(String::new(), |error| format!(", relMSE {:.2e}", error.relmse));
    let left = progress.seconds_left.map(|left| format!(", {} left", readable_seconds(left)));
    let seconds = readable_seconds(progress.seconds);
    format!("{} spp{error}, {seconds}{}", progress.spp, left.unwrap_or_default())
}
