//! Who made a picture: the command, the program, the machine and the date.

use std::env::consts::{ARCH, OS};
use std::time::{SystemTime, UNIX_EPOCH};

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
        let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        Self {
            command: std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect(),
            version: concat!("halflight ", env!("CARGO_PKG_VERSION")),
            machine: format!("{}, {ARCH} {OS}", processor().unwrap_or_else(|| "unnamed processor".into())),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            date: date(now),
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

/// `seconds` after 1970 as people write it, in UTC.
fn date(seconds: u64) -> String {
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    // Howard Hinnant's civil_from_days, for dates after 1970; years begin in March.
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    format!("{year}-{month:02}-{day:02} {:02}:{:02} UTC", second / 3600, second / 60 % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_as_the_calendar_has_them() {
        for (seconds, expected) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(date(seconds), expected);
        }
    }

    #[test]
    fn a_shell_reads_the_command_again() {
        let command = ["halflight", "render", "my scene.obj", "it's", "", "--eye=1,-2,3", "$HOME"];
        let maker = Maker { command: command.map(String::from).into(), ..Maker::here() };
        assert_eq!(maker.shell(), r"halflight render 'my scene.obj' 'it'\''s' '' --eye=1,-2,3 '$HOME'");
    }
}
