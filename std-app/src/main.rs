//! The command line; `halflight --help` lists its flags, docs/cli.md its interface for scripts.
#![forbid(unsafe_code)]

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
