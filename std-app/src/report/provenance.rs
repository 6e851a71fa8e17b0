//! Provenance of a picture: command, program, machine and date.

use core::fmt::Write;
use std::env::consts::{ARCH, OS};
use std::time::SystemTime;

/// Command, program, machine and date of a picture.
#[derive(Clone, Debug)]
pub struct Provenance {
    /// Words of the command line.
    pub command: Vec<String>,
    /// Name and version of the program.
    pub version: &'static str,
    /// Name of the processor if the system gives it, architecture and system.
    pub machine: String,
    /// Number of processors available to the program.
    pub processors: usize,
    /// Date and time in UTC, to the minute.
    pub date: String,
}

impl Provenance {
    /// Provenance of a picture made by this process, now.
    pub fn here() -> Self {
        Self {
            command: std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect(),
            version: concat!("halflight ", env!("CARGO_PKG_VERSION")),
            machine: format!("{}, {ARCH} {OS}", processor().unwrap_or_else(|| "unnamed processor".into())),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            date: date(SystemTime::now()),
        }
    }

    /// The command line as a shell reads it.
    pub fn command_line(&self) -> String {
        let is_plain = |c: char| c.is_alphanumeric() || "-_=+,./:@%".contains(c);
        let quoted = |word: &String| match !word.is_empty() && word.chars().all(is_plain) {
            true => word.clone(),
            false => format!("'{}'", word.replace('\'', "'\\''")),
        };
        self.command.iter().map(quoted).collect::<Vec<_>>().join(" ")
    }
}

fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// Date as `2000-02-29 00:00 UTC`, 1970 for earlier times.
fn date(time: SystemTime) -> String {
    let mut stamp = String::new();
    // Fails after the year 9999.
    let _ = write!(stamp, "{}", humantime::format_rfc3339_seconds(time.max(SystemTime::UNIX_EPOCH)));
    format!("{} UTC", stamp.get(..16).unwrap_or_default().replace('T', " "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::time::Duration;

    #[test]
    fn dates_follow_the_calendar() {
        for (seconds, expected) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(date(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)), expected);
        }
    }
}
