//! Flags of `halflight render` as keywords of another language: their names, and the settings that follow
//! from them by the checks of the command line.

use super::failure::Failure;
use super::render::Render;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command, CommandFactory, FromArgMatches, Parser};
use core::fmt;
use halflight::load::LoadedScene;
use halflight::render::{Settings, Stop};
use halflight::save::Image;
use halflight_core::scene::Camera;
use std::ffi::OsString;
use std::path::Path;
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

/// Flags of a render, checked.
pub struct Keywords(Render);

/// Flags that concern files and messages of the program, not the picture, and parts of pictures.
const WITHOUT: [&str; 12] = [
    "output",
    "json",
    "exposure",
    "view",
    "reference",
    "preview",
    "tev",
    "every",
    "progress",
    "quiet",
    "continue",
    "crop",
];

#[derive(Parser)]
#[command(no_binary_name = true, disable_help_flag = true, disable_version_flag = true)]
struct Words {
    #[command(flatten)]
    render: Render,
}

/// A keyword that is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// The problem, one sentence without a full stop.
    pub problem: String,
    /// Advice; may be empty.
    pub help: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.problem)?;
        if self.help.is_empty() { Ok(()) } else { write!(f, "\n  help: {}", self.help) }
    }
}

impl core::error::Error for Refused {}

impl From<Failure> for Refused {
    fn from(failure: Failure) -> Self {
        let (problem, help) = failure.into_parts();
        Self { problem, help }
    }
}

/// The name of a keyword: that of its flag with underscores.
fn keyword(arg: &Arg) -> Option<String> {
    let name = arg.get_long().filter(|name| !WITHOUT.contains(name))?;
    Some(name.replace('-', "_"))
}

fn flag<'a>(command: &'a Command, name: &str) -> Option<&'a Arg> {
    command.get_arguments().find(|arg| keyword(arg).is_some_and(|keyword| keyword == name))
}

/// The flags, built once: a render of a few milliseconds must not wait for them.
fn command() -> MutexGuard<'static, Command> {
    static COMMAND: LazyLock<Mutex<Command>> = LazyLock::new(|| Mutex::new(Words::command()));
    COMMAND.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Keywords {
    /// Names of all keywords.
    pub fn names() -> Vec<String> {
        names(&command())
    }

    /// Checks keywords and values as the command line checks them. `on` and `off` stand for a flag without a
    /// value; `on` is `auto` where a flag has no `on`.
    ///
    /// # Errors
    /// A keyword or a value that does not exist.
    pub fn parse(scene: &Path, given: &[(String, String)]) -> Result<Self, Refused> {
        let mut command = command();
        let mut words: Vec<OsString> = Vec::new();
        for (name, value) in given {
            let Some(arg) = flag(&command, name) else { return Err(unknown(&command, name)) };
            let long = arg.get_long().unwrap_or_default();
            if !arg.get_action().takes_values() {
                words.extend((value != "off").then(|| format!("--{long}").into()));
                continue;
            }
            let choices = arg.get_possible_values();
            let has = |name: &str| choices.iter().any(|choice| choice.matches(name, true));
            let value = if value == "on" && !has("on") && has("auto") { "auto" } else { value };
            words.push(format!("--{long}={value}").into());
        }
        words.extend(["--".into(), scene.into()]);
        let matches = command.try_get_matches_from_mut(words).map_err(|error| refused(&error))?;
        Words::from_arg_matches(&matches).map(|words| Self(words.render)).map_err(|error| refused(&error))
    }

    /// Settings and camera of a picture of `loaded`, completed by its scene file. Without a rule the picture
    /// ends as one of the program does.
    ///
    /// # Errors
    /// Keywords that do not fit the scene.
    pub fn settings(
        &self,
        loaded: &LoadedScene,
        reference: Option<Arc<Image>>,
    ) -> Result<(Settings, Camera), Refused> {
        let Self(render) = self;
        let (mut stop, _) = render.stop(loaded)?;
        let camera = render.camera(loaded)?;
        if loaded.views().scene(camera).is_dark() {
            stop = Stop { spp: stop.spp.or(Some(1)), ..stop };
        }
        Ok((render.settings(loaded, stop, reference)?, camera))
    }
}

fn names(command: &Command) -> Vec<String> {
    command.get_arguments().filter_map(keyword).collect()
}

/// The refusal of a name.
fn unknown(command: &Command, name: &str) -> Refused {
    let problem = format!("there is no setting `{name}`");
    Refused { problem, help: format!("the settings are {}", names(command).join(", ")) }
}

/// The name of the keyword of a flag in messages, as `--spp <N>`.
fn name_of(flag: &str) -> String {
    flag.trim_start_matches('-').split([' ', '=']).next().unwrap_or_default().replace('-', "_")
}

fn text(error: &clap::Error, kind: ContextKind) -> Option<String> {
    match error.get(kind)? {
        ContextValue::String(text) => Some(text.clone()),
        ContextValue::Strings(texts) => Some(texts.join(", ")),
        _ => None,
    }
}

/// The refusal of a value in the words of keywords.
fn refused(error: &clap::Error) -> Refused {
    let name = text(error, ContextKind::InvalidArg).map(|flag| name_of(&flag));
    let value = text(error, ContextKind::InvalidValue).unwrap_or_default();
    let given = format!("{}={value}", name.as_deref().unwrap_or("setting"));
    let problem = match error.kind() {
        ErrorKind::InvalidValue => {
            let choices = text(error, ContextKind::ValidValue).unwrap_or_default();
            format!("{given}: expected one of {choices}")
        }
        ErrorKind::ValueValidation => {
            let why = core::error::Error::source(error).map(ToString::to_string).unwrap_or_default();
            format!("{given}: {why}")
        }
        ErrorKind::MissingRequiredArgument => {
            format!("another setting is required with these: {}", name.as_deref().unwrap_or_default())
        }
        ErrorKind::ArgumentConflict => {
            let other = text(error, ContextKind::PriorArg).map(|flag| name_of(&flag)).unwrap_or_default();
            format!("`{}` and `{other}` exclude each other", name.as_deref().unwrap_or_default())
        }
        _ => error.to_string().lines().next().unwrap_or_default().replace("error: ", ""),
    };
    Refused { problem, help: String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(given: &[(&str, &str)]) -> Result<Keywords, Refused> {
        let given: Vec<_> = given.iter().map(|(name, value)| ((*name).into(), (*value).into())).collect();
        Keywords::parse(Path::new("scene.obj"), &given)
    }

    #[test]
    fn keywords_are_the_flags_of_a_picture() {
        let names = Keywords::names();
        for name in
            ["spp", "time", "error", "size", "method", "eye", "cache_error", "precise", "aov", "report"]
        {
            assert!(names.iter().any(|known| known == name), "{name}");
        }
        assert!(!names.iter().any(|name| ["output", "json", "scene"].contains(&&**name)));
    }

    #[test]
    fn values_are_those_of_flags() {
        for given in [
            [("spp", "16"), ("size", "64x48")],
            [("precise", "on"), ("reuse", "on")],
            [("caustics", "on"), ("audit", "off")],
            [("eye", "-1,2,3"), ("look_at", "0,0,-1")],
        ] {
            assert!(parse(&given).is_ok(), "{given:?}");
        }
    }

    #[test]
    fn refusals_name_the_keyword() {
        let refusal = |name: &str, value: &str| parse(&[(name, value)]).err().unwrap().to_string();
        assert!(refusal("cach_error", "1").contains("`cach_error`\n  help: the settings are "));
        assert_eq!(refusal("spp", "0"), "spp=0: samples per pixel are a number from 1 to 2^30");
        assert!(refusal("reuse", "maybe").starts_with("reuse=maybe: expected one of auto, on, off"));
        assert!(refusal("shard", "1/4").contains("checkpoint"));
        assert!(refusal("output", "a.png").starts_with("there is no setting `output`"));
    }
}
