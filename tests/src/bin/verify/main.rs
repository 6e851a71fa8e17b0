//! All checks of the project, for developers and CI: `cargo verify [STEP…] [--allow-missing] [--fuzz-seconds
//! N]` runs the named steps, or all that need no other programs; `cargo verify quick` runs the steps that
//! take about a minute after a build.
#![forbid(unsafe_code)]

mod bindings;
mod cluster;
mod command;
mod doors;
mod fuzz;
mod layers;
mod limits;
mod names;
mod package;
mod pages;
mod python;
mod quality;
mod source;
mod targets;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// A named check.
struct Step {
    name: &'static str,
    what: &'static str,
    run: fn(&Project) -> Outcome,
    when: When,
}

/// Runs without named steps that include a step.
#[derive(Clone, Copy, PartialEq)]
enum When {
    /// The full run and the quick run.
    Always,
    /// The full run.
    Whole,
    /// The quick run; the full run has a step that includes this one.
    Quick,
    /// None: named alone, since it needs other programs or takes many minutes.
    Named,
    /// The run of the interfaces for other languages, which need compilers and browsers of their own.
    Bindings,
    /// The full run, and that of the interfaces for other languages.
    WholeAndBindings,
}

/// The name of all quick steps.
const QUICK: &str = "quick";

/// The name of all steps of the interfaces for other languages.
const BINDINGS: &str = "bindings";

/// Summary of a step in one line, or why it failed.
type Outcome = Result<String, Failure>;

/// Reasons why a step did not pass.
enum Failure {
    /// A tool is not installed, with instructions; passes with `--allow-missing`.
    Missing(String),
    /// The check failed.
    Failed(String),
}

/// Options of a run.
struct Project {
    root: PathBuf,
    /// Run time of each fuzz target, seconds.
    fuzz_seconds: u32,
}

const STEPS: &[Step] = &[
    step("source", "house rules that no compiler checks", source::check, When::Always),
    step("fmt", "rustfmt leaves every workspace as it is", quality::fmt, When::Always),
    step("clippy", "no warning in any workspace", quality::clippy, When::Whole),
    step("test", "cargo test --profile quick --workspace", quality::test, When::Whole),
    step("doors", "public names of the core are those of core/doors.txt", doors::check, When::Whole),
    step("docs", "rustdoc without a warning", quality::docs, When::Whole),
    step("targets", "the tiny render on every target: same bits", targets::check, When::Whole),
    step("c", "programs in C and C++ call the library", bindings::c, When::Bindings),
    step("web", "the module for browsers: bits, types, its page", bindings::web, When::Bindings),
    step("fuzz", "a short run of every fuzz target", fuzz::smoke, When::Whole),
    step("python", "the wheel of the Python package passes its tests", python::check, When::WholeAndBindings),
    step("cluster", "parts under Slurm and others: bits of one run", cluster::check, When::Named),
    step("package", "published crates: features, packages, oldest versions", package::check, When::Named),
    step("unit", "unit tests of core and simd", quality::unit, When::Quick),
    step("table", "methods × scenes × properties, in small pictures", quality::table, When::Quick),
];

const fn step(name: &'static str, what: &'static str, run: fn(&Project) -> Outcome, when: When) -> Step {
    Step { name, what, run, when }
}

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
            name if [QUICK, BINDINGS].contains(&name) || STEPS.iter().any(|step| step.name == name) => {
                names.push(argument)
            }
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

    let is_named = |step: &Step, name: &String| match name.as_str() {
        QUICK => matches!(step.when, When::Always | When::Quick),
        BINDINGS => matches!(step.when, When::Bindings | When::WholeAndBindings),
        name => name == step.name,
    };
    let chosen = STEPS.iter().filter(|step| match names.is_empty() {
        true => matches!(step.when, When::Always | When::Whole | When::WholeAndBindings),
        false => names.iter().any(|name| is_named(step, name)),
    });
    let results: Vec<_> = chosen.map(|step| run(step, &project, allow_missing)).collect();
    println!("\nverify:");
    for (line, _) in &results {
        println!("  {line}");
    }
    if results.iter().all(|(_, good)| *good) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Runs a step and returns its summary line, and whether it passed.
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
    text += &format!("  {QUICK:<8} source, fmt, unit and table: what to run after an edit\n");
    text += &format!("  {BINDINGS:<8} c, web and python: interfaces for other languages\n");
    text + "\n--allow-missing    a step whose tool is not on this machine is skipped instead of failing\n\
            --fuzz-seconds N   how long each fuzz target runs; 10 if not said, 600 for a campaign"
}
