//! The command line: what was asked for, who does it, and how it ends.

mod compare;
mod failure;

use clap::{Parser, Subcommand};
use failure::Failure;
use std::panic;
use std::process::ExitCode;

/// Renders scenes, and says how wrong the pictures are.
#[derive(Parser)]
#[command(name = "halflight", version, about, max_term_width = 100, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Compare(compare::Compare),
}

/// Runs the program. The exit codes are a contract: 0 done, 2 usage or bad input, 3 stopped early with a
/// valid picture saved.
pub(crate) fn main() -> ExitCode {
    // Clap prints its own message, and exits with 2 on wrong usage, 0 after help.
    let Command::Compare(command) = Cli::parse().command;
    let outcome = panic::catch_unwind(|| command.run()).unwrap_or_else(|_| {
        Err(Failure::new("the program met an error of its own; the message above says where")
            .advice("please report it, with the command and the scene"))
    });
    match outcome {
        Ok(code) => code,
        Err(failure) => {
            eprintln!("{failure}");
            ExitCode::from(2)
        }
    }
}
