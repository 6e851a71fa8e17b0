//! `halflight stability`: stiff and extreme cases with known answers.

use super::failure::Failure;
use super::stdio::print_result;
use clap::Args;
use halflight::report::quantity::plural;
use halflight::stability::{self, Outcome};
use serde_json::{Value, json};
use std::process::ExitCode;

/// Run stiff and extreme cases with known answers on this machine
///
/// The cases are scenes of size 1e-6 to 1e6, lights of size 1e-9 to 1e9, needles, perfect mirrors, cameras in
/// glass, and kernels against f64. The exit code is 1 if a case differs from its answer.
#[derive(Args)]
pub(super) struct Stability {
    /// Run only cases whose kind or name contains this word
    #[arg(long, value_name = "WORD")]
    only: Option<String>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

impl Stability {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let is_selected = |name: &str| self.only.as_ref().is_none_or(|word| name.contains(word.as_str()));
        let (mut group, mut printed) = ("", Ok(()));
        let outcomes = stability::run(&is_selected, &mut |outcome| {
            if !self.json && printed.is_ok() {
                let head =
                    if outcome.group == group { String::new() } else { format!("{}\n", outcome.group) };
                group = outcome.group;
                printed = print_result(&(head + &line(outcome)));
            }
        });
        printed?;
        let failed = outcomes.iter().filter(|outcome| !outcome.passed).count();
        print_result(&if self.json {
            let cases: Value = outcomes.iter().map(object).collect();
            json!({ "cases": cases, "passed": outcomes.len() - failed, "failed": failed }).to_string()
        } else {
            format!("{}, {failed} not as expected", plural(outcomes.len() as u64, "case"))
        })?;
        Ok(if failed == 0 { ExitCode::SUCCESS } else { ExitCode::from(1) })
    }
}

fn line(outcome: &Outcome) -> String {
    let Outcome { case, expected, measured, passed, .. } = outcome;
    let mark = if *passed { "as expected" } else { "NOT AS EXPECTED" };
    format!("  {case:<66} {expected:>16}  {measured:<28} {mark}")
}

fn object(outcome: &Outcome) -> Value {
    json!({
        "group": outcome.group,
        "case": outcome.case,
        "expected": outcome.expected,
        "measured": outcome.measured,
        "passed": outcome.passed,
    })
}
