//! Progress on stderr: a bar with the time left on a terminal, a plain line every few seconds elsewhere.

use super::stdio::{tell, warn};
use halflight::drive::Progress;
use halflight::report::words::readable_seconds;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, stderr};

/// Seconds between plain lines.
const EVERY: f64 = 5.0;

/// Steps of the bar.
const STEPS: u64 = 1000;

/// Tells how a render goes.
pub(super) struct Teller {
    bar: Option<ProgressBar>,
    told: f64,
}

impl Teller {
    pub(super) fn new() -> Self {
        let style = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}");
        let bar = stderr().is_terminal().then(|| ProgressBar::new(STEPS));
        Self { bar: bar.map(|bar| bar.with_style(style.unwrap_or(ProgressStyle::default_bar()))), told: 0.0 }
    }

    /// After each round.
    pub(super) fn tell(&mut self, progress: &Progress) {
        self.tell_words(progress, words(progress));
    }

    /// After each round of one of several.
    pub(super) fn tell_of(&mut self, name: &str, progress: &Progress) {
        self.tell_words(progress, format!("{name}: {}", words(progress)));
    }

    fn tell_words(&mut self, progress: &Progress, words: String) {
        if let Some(why) = &progress.unsaved {
            let note = || warn(format_args!("{why}; the render goes on, and tries again"));
            self.bar.as_ref().map_or_else(note, |bar| bar.suspend(note));
        }
        let share = progress.seconds_left.map(|left| progress.seconds / (progress.seconds + left).max(1e-9));
        if let Some(bar) = &self.bar {
            bar.set_position((share.unwrap_or(0.0) * STEPS as f64) as u64);
            bar.set_message(words);
        } else if progress.seconds >= self.told + EVERY {
            self.told = progress.seconds;
            tell(format_args!("{:>3.0} %  {words}", 100.0 * share.unwrap_or(0.0)));
        }
    }

    /// Takes the bar away.
    pub(super) fn end(self) {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
    }
}

fn words(progress: &Progress) -> String {
    let mut words = format!("{} spp", progress.spp);
    if let Some(error) = progress.error {
        words += &format!(", relMSE {:.2e}", error.relmse);
    }
    words += &format!(", {}", readable_seconds(progress.seconds));
    if let Some(left) = progress.seconds_left {
        words += &format!(", {} left", readable_seconds(left));
    }
    words
}
