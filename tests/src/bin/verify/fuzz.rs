//! A short run of every fuzz target from its corpus by the driver `mutate`. A campaign, which
//! `--fuzz-seconds` asks for, is guided by coverage where cargo-fuzz and a nightly toolchain are installed.

use crate::command::{command, fresh_cargo, in_pairs, output, run};
use crate::{Failure, Outcome, Project};
use std::fs;
use std::process::{Command, Stdio};

/// Longest smoke run of a target, seconds; anything longer is a campaign.
pub(crate) const SMOKE_SECONDS: u32 = 10;

/// Runs of each target in a smoke run: the corpus and some hundreds of mutations.
const SMOKE_RUNS: i32 = 400;

pub(crate) fn smoke(project: &Project) -> Outcome {
    let folder = project.root.join("fuzz");
    let seconds = project.fuzz_seconds;
    let io = |error: std::io::Error| Failure::Failed(format!("{}: {error}", folder.display()));
    let mut targets = Vec::new();
    for entry in fs::read_dir(folder.join("fuzz_targets")).map_err(io)? {
        targets.extend(entry.map_err(io)?.path().file_stem().map(|name| name.to_string_lossy().into_owned()));
    }
    targets.sort();

    // libFuzzer needs sanitized builds of everything, which take longer than the short runs.
    let is_campaign = seconds > SMOKE_SECONDS;
    let coverage = is_campaign && has_cargo_fuzz();
    // One build for all targets, beside the products of the main workspace, whose dependencies it shares.
    let products = project.root.join("target");
    if !coverage {
        let line =
            "cargo build --quiet --profile quick --locked --no-default-features --features app --bin mutate";
        run(command(&folder, line).env("CARGO_TARGET_DIR", &products))?;
    }
    let driver = products.join("quick/mutate");
    // Smoke runs end after a fixed number of runs, so that every machine has the same result; campaigns end
    // by the clock.
    let runs = if is_campaign { -1 } else { SMOKE_RUNS };
    let results = in_pairs(&targets, |target| {
        if coverage {
            // libFuzzer writes new inputs to the first directory; the second is the corpus of the repository.
            fs::create_dir_all(folder.join("corpus-run").join(target)).map_err(io)?;
            let line = format!(
                "cargo +nightly fuzz run --fuzz-dir . {target} corpus-run/{target} corpus/{target} -- \
                 -seed=1 -runs={runs} -max_total_time={seconds} -timeout=10 -verbosity=0 -print_final_stats=1"
            );
            // No leak detection: it needs ptrace, which sandboxes forbid.
            run(fresh_cargo(&folder, &line).env("ASAN_OPTIONS", "detect_leaks=0"))
        } else {
            let limits = format!("{target} --seconds {seconds} --runs {runs} --seed 1");
            println!("{}", output(Command::new(&driver).current_dir(&folder).args(limits.split(' ')))?);
            Ok(())
        }
    });
    results.into_iter().collect::<Result<(), Failure>>()?;
    let name = if coverage { "libFuzzer" } else { "the stable driver" };
    let length = if is_campaign { format!("{seconds} s") } else { format!("{SMOKE_RUNS} runs") };
    Ok(format!("{} targets, {length} each, by {name}", targets.len()))
}

fn has_cargo_fuzz() -> bool {
    let answers = |arguments: &[&str]| {
        let mut cargo = Command::new("cargo");
        cargo.args(arguments).env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO");
        let quiet = cargo.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        quiet.status().is_ok_and(|status| status.success())
    };
    answers(&["+nightly", "--version"]) && answers(&["fuzz", "--version"])
}
