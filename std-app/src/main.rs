//! The command line. See `halflight --help`, and docs/cli.md for what scripts may rely on.
#![forbid(unsafe_code)]

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
