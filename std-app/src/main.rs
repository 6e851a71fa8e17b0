//! The program `halflight`.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    halflight::cli::main(std::env::args_os())
}
