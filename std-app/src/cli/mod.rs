//! The command line: what was asked for, who does it, and how it ends.

mod bench;
mod compare;
mod failure;
mod info;
mod interrupt;
mod ledger;
mod merge;
mod method;
mod outputs;
mod progress;
mod race;
mod racer;
mod render;
mod shot;
mod stability;
mod stdio;
mod study;
mod summary;
mod values;
mod view;

use clap::{Parser, Subcommand};
use failure::Failure;
use halflight::memory::Budget;
use halflight::save::{self, Image};
use std::io::{Write, stdout};
use std::panic;
use std::path::Path;
use std::process::ExitCode;
use stdio::{heard, say, tell, warn};

/// Renders scenes, and says how wrong the pictures are.
#[derive(Parser)]
#[command(name = "halflight", version, about, max_term_width = 100, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Render(Box<render::Render>),
    Compare(compare::Compare),
    Merge(merge::Merge),
    Race(Box<race::Race>),
    Info(info::Info),
    Bench(bench::Bench),
    Stability(stability::Stability),
    Study(study::Study),
}

/// Runs the program. The exit codes are a contract: 0 done, 2 usage or bad input, 3 stopped early with a
/// valid picture saved.
pub(crate) fn main() -> ExitCode {
    interrupt::outlive_limits();
    panic::set_hook(Box::new(|panic| tell(format_args!("halflight met an error of its own: {panic}"))));
    let command = match Cli::try_parse() {
        Ok(cli) => cli.command,
        Err(message) => return end_with(&message),
    };
    let outcome = panic::catch_unwind(panic::AssertUnwindSafe(|| match command {
        Command::Render(command) => command.run(),
        Command::Compare(command) => command.run(),
        Command::Merge(command) => command.run(),
        Command::Race(command) => command.run(),
        Command::Info(command) => command.run(),
        Command::Bench(command) => command.run(),
        Command::Stability(command) => command.run(),
        Command::Study(command) => command.run(),
    }));
    match outcome {
        Ok(Ok(code)) => return code,
        Ok(Err(failure)) => tell(failure),
        Err(_) => tell("  help: please report it, with the command and the scene"),
    }
    ExitCode::from(2)
}

/// The picture in a file, whose pixels `budget` has taken; says what had to be repaired.
fn read_picture(path: &Path, budget: &mut Budget) -> Result<Image, Failure> {
    let (image, notes) = save::read_within(path, budget.left())?;
    notes.iter().for_each(warn);
    budget.take(size_of_val(&image.pixels[..]))?;
    Ok(image)
}

/// Prints clap's own message: help and version are results, wrong usage is none.
fn end_with(message: &clap::Error) -> ExitCode {
    let printed = message.print().and_then(|()| stdout().flush());
    match heard(printed).err().filter(|_| !message.use_stderr()) {
        Some(failure) => tell(failure),
        None if !message.use_stderr() => return ExitCode::SUCCESS,
        None => {}
    }
    ExitCode::from(2)
}
