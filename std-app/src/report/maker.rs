//! Who made a picture: the command, the program, the machine and the date.

use core::fmt::Write;
use std::env::consts::{ARCH, OS};
use std::time::SystemTime;

/// What made a picture.
#[derive(Clone, Debug)]
pub struct Maker {
    /// The command line, word by word.
    pub command: Vec<String>,
    /// Name and version of the program.
    pub version: &'static str,
    /// The processor by name where the system tells it, and the system.
    pub machine: String,
    /// Processors that the program may use at once.
    pub processors: usize,
    /// When, in UTC.
    pub date: String,
}

impl Maker {
    /// This program, on this machine, now.
    pub fn here() -> Self {
        Self {
            command: std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect(),
            version: concat!("halflight ", env!("CARGO_PKG_VERSION")),
            machine: format!("{}, {ARCH} {OS}", processor().unwrap_or_else(|| "unnamed processor".into())),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            date: date(SystemTime::now()),
        }
    }

    /// The command as a POSIX shell reads it.
    pub fn shell(&self) -> String {
        self.command.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
    }
}

fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// A time as people write it, in UTC and to the minute; clocks before 1970 show 1970.
fn date(time: SystemTime) -> String {
    let mut text = String::new();
    // Fails after the year 9999.
    let _ = write!(text, "{}", humantime::format_rfc3339_seconds(time.max(SystemTime::UNIX_EPOCH)));
    let (day, time) = text.split_once('T').unwrap_or((&text, ""));
    format!("{day} {} UTC", time.get(..5).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::time::Duration;

    #[test]
    fn dates_as_the_calendar_has_them() {
        for (seconds, expected) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(date(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)), expected);
        }
    }

    #[test]
    fn a_shell_reads_the_command_again() {
        let command = ["halflight", "render", "my scene.obj", "it's", "", "--eye=1,-2,3", "$HOME"];
        let maker = Maker { command: command.map(String::from).into(), ..Maker::here() };
        assert_eq!(maker.shell(), r"halflight render 'my scene.obj' 'it'\''s' '' --eye=1,-2,3 '$HOME'");
    }
}
