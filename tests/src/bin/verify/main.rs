//! Every check of the project in one program, the same for a person and for CI:
//! `cargo verify [STEP…] [--allow-missing] [--fuzz-seconds N]`, all steps when none is named.
#![forbid(unsafe_code)]

mod command;
mod fuzz;
mod layers;
mod quality;
mod source;
mod targets;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// A check by name.
struct Step {
    name: &'static str,
    what: &'static str,
    run: fn(&Project) -> Outcome,
}

/// One line that says what was done, or why it went wrong.
type Outcome = Result<String, Failure>;

/// Why a step did not pass.
enum Failure {
    /// A tool is not on this machine: how to get it. Passes with `--allow-missing`.
    Missing(String),
    /// The check failed.
    Failed(String),
}

/// What the steps need to know.
struct Project {
    root: PathBuf,
    /// How long each fuzz target runs.
    fuzz_seconds: u32,
}

const STEPS: &[Step] = &[
    Step { name: "source", what: "house rules that no compiler checks", run: source::check },
    Step { name: "fmt", what: "rustfmt leaves every workspace as it is", run: quality::fmt },
    Step { name: "clippy", what: "no warning in any workspace", run: quality::clippy },
    Step { name: "test", what: "cargo test --release --workspace", run: quality::test },
    Step { name: "docs", what: "rustdoc without a warning", run: quality::docs },
    Step { name: "targets", what: "the tiny render on every target: same bits", run: targets::check },
    Step { name: "fuzz", what: "a short run of every fuzz target", run: fuzz::smoke },
];

fn main() -> ExitCode {
    let mut allow_missing = false;
    let mut fuzz_seconds = fuzz::SMOKE_SECONDS;
    let mut names = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--fuzz-seconds" => match arguments.next().and_then(|seconds| seconds.parse().ok()) {
                Some(seconds) => fuzz_seconds = seconds,
                None => {
                    eprintln!("verify: --fuzz-seconds wants a number\n\n{}", usage());
                    return ExitCode::from(2);
                }
            },
            "--allow-missing" => allow_missing = true,
            name if STEPS.iter().any(|step| step.name == name) => names.push(argument),
            "--help" | "-h" => {
                println!("{}", usage());
                return ExitCode::SUCCESS;
            }
            _ => {
                eprintln!("verify: no step or option is called `{argument}`\n\n{}", usage());
                return ExitCode::from(2);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let project = Project { root: root.canonicalize().unwrap_or(root), fuzz_seconds };

    let chosen = STEPS.iter().filter(|step| names.is_empty() || names.iter().any(|name| name == step.name));
    let results: Vec<_> = chosen.map(|step| run(step, &project, allow_missing)).collect();
    println!("\nverify:");
    for (line, _) in &results {
        println!("  {line}");
    }
    if results.iter().all(|(_, good)| *good) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Runs one step; its line of the summary, and whether it passed.
fn run(step: &Step, project: &Project, allow_missing: bool) -> (String, bool) {
    println!("\n== {}: {}", step.name, step.what);
    let start = Instant::now();
    let (verdict, text, good) = match (step.run)(project) {
        Ok(text) => ("ok", text, true),
        Err(Failure::Missing(text)) if allow_missing => ("skipped", text, true),
        Err(Failure::Missing(text)) => ("MISSING", text, false),
        Err(Failure::Failed(text)) => ("FAILED", text, false),
    };
    let line = format!("{:<8} {verdict:<8} {:>6.1} s  {text}", step.name, start.elapsed().as_secs_f32());
    println!("{line}");
    (line, good)
}

fn usage() -> String {
    let mut text = "cargo verify [STEP…] [--allow-missing] [--fuzz-seconds N]\n\n".to_owned();
    for step in STEPS {
        text += &format!("  {:<8} {}\n", step.name, step.what);
    }
    text + "\n--allow-missing    a step whose tool is not on this machine is skipped instead of failing\n\
            --fuzz-seconds N   how long each fuzz target runs; 20 if not said, 600 for a campaign"
}
