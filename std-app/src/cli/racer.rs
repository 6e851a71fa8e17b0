//! A method of a race, `NAME[:OPTION[=VALUE]]…` as in `path:max-depth=2:seed=7`. The options are the flags of
//! `render` that say how a method works, without their dashes, so that a new flag is a new option at once.

use super::method::{self, Choice};
use super::shot::Options;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, ValueEnum};

/// A method and what is special about it.
#[derive(Clone)]
pub(super) struct Racer {
    /// As it was written.
    pub(super) name: String,
    pub(super) method: Choice,
    pub(super) options: Options,
}

/// The options as flags.
#[derive(Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct Flags {
    #[command(flatten)]
    options: Options,
}

/// Reads one method of `--methods`.
pub(super) fn racer(text: &str) -> Result<Racer, String> {
    let mut parts = text.split(':').map(str::trim);
    let name = parts.next().unwrap_or_default();
    let method = Choice::from_str(name, false).map_err(|_| format!("the methods are {}", method::names()))?;
    let flags: Vec<String> = parts.map(|option| format!("--{option}")).collect();
    if flags.iter().any(|flag| flag == "--") {
        return Err("no option follows the colon".into());
    }
    let options = Flags::try_parse_from(&flags).map_err(|error| explain(&error))?.options;
    Ok(Racer { name: text.trim().into(), method, options })
}

fn explain(error: &clap::Error) -> String {
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => text.trim_start_matches("--").to_owned(),
        _ => String::new(),
    };
    match error.kind() {
        ErrorKind::UnknownArgument => {
            let command = Flags::command();
            let names: Vec<_> = command.get_arguments().filter_map(|argument| argument.get_long()).collect();
            let unknown = context(ContextKind::InvalidArg);
            format!("there is no option `{unknown}`; the options are {}", names.join(", "))
        }
        _ => {
            // The first line says what is wrong; the others are about flags.
            let text = error.to_string();
            text.lines().next().unwrap_or_default().trim_start_matches("error: ").replace("'--", "'")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_as_people_write_them() {
        let plain = racer("path").unwrap();
        assert_eq!(plain.name, "path");
        let special = racer("auto:max-depth=3:precise:seed=7").unwrap();
        assert_eq!(special.name, "auto:max-depth=3:precise:seed=7");
        let words = format!("{:?}", special.options);
        for part in ["max_depth: Some(3)", "seed: Some(7)", "precise: true"] {
            assert!(words.contains(part), "{words}");
        }
        let over = racer("path:seed=1").unwrap().options.over(&special.options);
        let words = format!("{over:?}");
        assert!(words.contains("max_depth: Some(3)") && words.contains("seed: Some(1)"), "{words}");
    }

    #[test]
    fn methods_that_make_no_sense() {
        for (text, reason) in [
            ("", "the methods are auto, path, irradiance-cache, photon-map, sppm"),
            ("paths", "the methods are auto, path, irradiance-cache, photon-map, sppm"),
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
            let said = racer(text).map(|racer| racer.name).unwrap_err();
            assert!(said.contains(reason), "{text}: {said}");
        }
    }
}
