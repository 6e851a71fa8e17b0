//! Method of a race: `NAME[:OPTION[=VALUE]]…` as in `path:max-depth=2:seed=7`. Options are the flags of
//! [`MethodArgs`] without dashes, so every new flag is an option as well.

use super::picture_args::{MethodArg, MethodArgs};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, ValueEnum};

/// Method of a race with its options.
#[derive(Clone)]
pub(super) struct RaceEntry {
    /// Text of the command line.
    pub(super) name: String,
    pub(super) method: MethodArg,
    /// Its options as flags, which are valid.
    flags: Vec<String>,
}

impl RaceEntry {
    /// The settings of the race with its own, which win.
    pub(super) fn args(&self, race: &MethodArgs) -> Result<MethodArgs, clap::Error> {
        let mut flags = Flags { args: race.clone() };
        flags.try_update_from(&self.flags)?;
        flags.args.precise |= race.precise;
        Ok(flags.args)
    }
}

/// Options as flags.
#[derive(Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct Flags {
    #[command(flatten)]
    args: MethodArgs,
}

/// Parses one method of `--methods`.
pub(super) fn race_entry(text: &str) -> Result<RaceEntry, String> {
    let mut parts = text.split(':').map(str::trim);
    let name = parts.next().unwrap_or_default();
    let method =
        MethodArg::from_str(name, false).map_err(|_| format!("the methods are {}", MethodArg::names()))?;
    let flags: Vec<String> = parts.map(|option| format!("--{option}")).collect();
    if flags.iter().any(|flag| flag == "--") {
        return Err("no option follows the colon".into());
    }
    Flags::try_parse_from(&flags).map_err(|error| message(&error))?;
    Ok(RaceEntry { name: text.trim().into(), method, flags })
}

/// Message of clap in terms of options.
fn message(error: &clap::Error) -> String {
    if error.kind() == ErrorKind::UnknownArgument {
        let unknown = match error.get(ContextKind::InvalidArg) {
            Some(ContextValue::String(text)) => text.trim_start_matches("--"),
            _ => "",
        };
        let command = Flags::command();
        let names: Vec<_> = command.get_arguments().filter_map(|argument| argument.get_long()).collect();
        return format!("there is no option `{unknown}`; the options are {}", names.join(", "));
    }
    // The first line has the error, the others are about flags.
    let text = error.to_string();
    text.lines().next().unwrap_or_default().trim_start_matches("error: ").replace("'--", "'")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_follow_colons_and_win_over_the_race() {
        let plain = race_entry("path").unwrap();
        assert_eq!(plain.name, "path");
        let special = race_entry("auto:max-depth=3:precise:seed=7").unwrap();
        assert_eq!(special.name, "auto:max-depth=3:precise:seed=7");
        let race = Flags::parse_from::<_, &str>([]).args;
        let args = |entry: &RaceEntry, race| entry.args(race).unwrap();
        let own = args(&special, &race);
        for (args, seed) in [(&own, 7), (&args(&race_entry("path:seed=1").unwrap(), &own), 1)] {
            let args = format!("{args:?}");
            for part in ["max_depth: Some(Depth(3))", &format!("seed: Some({seed})"), "precise: true"] {
                assert!(args.contains(part), "{args}");
            }
        }
    }

    #[test]
    fn invalid_entries_name_the_reason() {
        for (text, reason) in [
            ("", "the methods are auto, path, irradiance-cache, radiance-cache, photon-map"),
            ("paths", "the methods are auto, path, irradiance-cache, radiance-cache, photon-map"),
            (
                "path:sparkle=1",
                "there is no option `sparkle`; the options are caustics, reuse, windows, max-depth",
            ),
            ("path:", "no option"),
            ("path:max-depth=0", "max-depth"),
            ("path:max-depth", "max-depth"),
            ("path:simd=mmx", "the levels are"),
            ("path:seed=1:seed=2", "seed"),
            ("path:help", "there is no option `help`"),
        ] {
            let error = race_entry(text).map(|entry| entry.name).unwrap_err();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }
}
