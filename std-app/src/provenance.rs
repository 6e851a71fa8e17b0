//! Provenance of a picture: command, program, machine and date.

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
    let minutes = time.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |past| past.as_secs() / 60);
    let (hours, minute) = (minutes / 60, minutes % 60);
    // Days since 0000-03-01: the leap day ends a year, and 146097 days are 400 years.
    let (day, hour) = (hours / 24 + 719_468, hours % 24);
    let day_of_era = day % 146_097;
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    // Five months from March have 153 days.
    let month = (5 * day_of_year + 2) / 153;
    let day_of_month = day_of_year - (153 * month + 2) / 5 + 1;
    let year = day / 146_097 * 400 + year_of_era + u64::from(month >= 10);
    format!("{year:04}-{:02}-{day_of_month:02} {hour:02}:{minute:02} UTC", (month + 2) % 12 + 1)
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
            (1_735_689_599, "2024-12-31 23:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(date(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)), expected);
        }
    }
}
