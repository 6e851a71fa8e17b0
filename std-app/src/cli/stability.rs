//! `halflight stability`: the table of stiff and extreme cases, each with what it must give and what it gives.

use super::failure::Failure;
use super::say;
use clap::Args;
use halflight::report::words::plural;
use halflight::stability::{self, Outcome};
use serde_json::{Value, json};
use std::process::ExitCode;

/// Run the table of stiff and extreme cases on this machine
///
/// Sizes from 1e-6 to 1e6, lights from 1e-9 to 1e9 of the scene, needles, perfect mirrors, cameras within glass:
/// each case has an answer known by theory. Exits with 1 where one is missed.
#[derive(Args)]
pub(super) struct Stability {
    /// Only those whose kind or name has this in it
    #[arg(long, value_name = "WORD")]
    only: Option<String>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

impl Stability {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let wanted = |name: &str| self.only.as_ref().is_none_or(|word| name.contains(word.as_str()));
        let (mut group, mut said) = ("", Ok(()));
        let outcomes = stability::run(&wanted, &mut |outcome| {
            if !self.json && said.is_ok() {
                let head =
                    if outcome.group == group { String::new() } else { format!("{}\n", outcome.group) };
                group = outcome.group;
                said = say(&(head + &line(outcome)));
            }
        });
        let failed = outcomes.iter().filter(|outcome| !outcome.passed).count();
        said?;
        if self.json {
            let object = json!({
                "cases": outcomes.iter().map(object).collect::<Vec<_>>(),
                "passed": outcomes.len() - failed,
                "failed": failed,
            });
            say(&object.to_string())?;
        } else {
            say(&format!("{}, {failed} not as expected", plural(outcomes.len() as u64, "case")))?;
        }
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
