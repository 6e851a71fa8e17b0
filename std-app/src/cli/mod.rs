//! The command line: commands, their exit codes and internal errors. `halflight --help` lists its flags,
//! docs/cli.md its interface for scripts.

mod bake;
mod bake_files;
mod bake_parts;
mod camera_args;
mod checkpoint_args;
mod compare;
mod crop_args;
mod failure;
mod info;
mod interrupt;
mod keywords;
mod layer_args;
mod live_args;
mod manual;
mod merge;
mod outputs;
mod picture_args;
mod progress;
mod race;
mod race_entry;
mod render;
mod stdio;
mod summary;
mod values;
mod view_args;
#[cfg_attr(not(feature = "tev"), path = "no_viewer.rs")]
mod viewer;

pub use keywords::{Keywords, Refused};

use clap::{Arg, CommandFactory, FromArgMatches, Parser, Subcommand};
use failure::Failure;
use halflight::memory::Budget;
use halflight::pool::in_pool;
use halflight::save::{self, Image};
use std::ffi::OsString;
use std::io::{Write, stdout};
use std::panic;
use std::path::Path;
use std::process::ExitCode;
use stdio::{check_output, print_message, print_note};

/// Renders scenes and estimates the error of the pictures.
#[derive(Parser)]
#[command(name = "halflight", version, about, max_term_width = 100, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Render(Box<render::Render>),
    Bake(Box<bake::Bake>),
    Compare(compare::Compare),
    Merge(merge::Merge),
    Race(Box<race::Race>),
    Info(info::Info),
    Completions(manual::Completions),
    Man(manual::Man),
}

impl Command {
    /// Number of threads; `None`: all of the machine.
    fn threads(&self) -> Option<usize> {
        match self {
            Command::Render(command) => command.threads(),
            Command::Bake(command) => command.threads(),
            Command::Race(command) => command.threads(),
            _ => None,
        }
    }

    fn run(&self) -> Result<ExitCode, Failure> {
        match self {
            Command::Render(command) => command.run(),
            Command::Bake(command) => command.run(),
            Command::Compare(command) => command.run(),
            Command::Merge(command) => command.run(),
            Command::Race(command) => command.run(),
            Command::Info(command) => command.run(),
            Command::Completions(command) => command.run(&mut Cli::command()),
            Command::Man(command) => command.run(Cli::command()),
        }
    }
}

/// Runs the program with the words of a command line, whose first is its name. It handles signals of the
/// process. Exit codes are a contract (docs/cli.md).
pub fn main(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    interrupt::block_signals();
    panic::set_hook(Box::new(|panic| print_message(format_args!("internal error of halflight: {panic}"))));
    let command = match parse(words) {
        Ok(cli) => cli.command,
        Err(message) => return end_with(&message),
    };
    let run = || {
        in_pool(command.threads(), || command.run()).unwrap_or_else(|error| {
            Err(Failure::new(format!("no thread could be started: {error}"))
                .advice("raise the limit of processes: ulimit -u, or that of the control group"))
        })
    };
    match panic::catch_unwind(panic::AssertUnwindSafe(run)) {
        Ok(Ok(code)) => return code,
        Ok(Err(failure)) => print_message(failure),
        Err(_) => print_message("  help: please report it, with the command and the scene"),
    }
    ExitCode::from(2)
}

/// The command line. Values may be negative numbers, so that a flag can say which numbers it takes.
fn parse(words: impl IntoIterator<Item = OsString>) -> Result<Cli, clap::Error> {
    let with_negative = |argument: Arg| match argument.get_action().takes_values() {
        true => argument.allow_negative_numbers(true),
        false => argument,
    };
    let command = Cli::command().mut_subcommands(|command| command.mut_args(with_negative));
    Cli::from_arg_matches(&command.try_get_matches_from(words)?)
}

/// Picture in a file, whose pixels count in `budget`. Repairs are printed as notes.
fn read_picture(path: &Path, budget: &mut Budget) -> Result<Image, Failure> {
    let (image, notes) = save::read_within(path, budget.left())?;
    notes.iter().for_each(print_note);
    budget.take(size_of_val(&image.pixels[..]))?;
    Ok(image)
}

/// Prints help, version or wrong usage, which clap reports alike. Usage repeats arguments: it has no colours.
fn end_with(message: &clap::Error) -> ExitCode {
    if message.use_stderr() {
        print_message(message.to_string().trim_end());
        return ExitCode::from(2);
    }
    match check_output(message.print().and_then(|()| stdout().flush())) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            print_message(failure);
            ExitCode::from(2)
        }
    }
}
