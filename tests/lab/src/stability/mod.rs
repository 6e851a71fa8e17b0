//! Stiff and extreme cases of pictures and kernels, against known answers.
//!
//! Answers are furnaces, formulas, invariances or f64 references, never recorded results. A picture with
//! noise may differ by [`SIGMAS`] standard errors, a picture without noise by rounding alone.

mod derivatives;
mod geometry;
mod kernels;
mod light;
mod scene;
mod searches;
mod surfaces;
mod view;

use crate::output::Output;
use clap::Args;
use halflight::quantity::plural;
use scene::{Measured, TestScene};
use serde_json::{Value, json};

/// Tolerance in standard errors, which are estimated from some hundred pixels. By chance one case in a
/// hundred thousand fails.
const SIGMAS: f64 = 4.5;

/// Relative tolerance without noise: f32 rounding of paths of a few dozen products.
const ROUNDING: f64 = 2e-5;

/// Run stiff and extreme cases with known answers on this machine
///
/// The cases are scenes of size 1e-6 to 1e6, lights of size 1e-9 to 1e9, needles, perfect mirrors, cameras in
/// glass, and kernels against f64. The exit code is 1 if a case differs from its answer.
#[derive(Args)]
pub(crate) struct Stability {
    /// Run only cases whose kind or name contains this word
    #[arg(long, value_name = "WORD", default_value = "")]
    only: String,
}

impl Stability {
    /// Runs the cases, each of which is written at once; true if all have their known answers.
    pub(crate) fn run(&self, output: &mut Output) -> bool {
        let mut group = "";
        let outcomes = run(&|name| name.contains(&self.only), &mut |outcome| {
            if outcome.group != group {
                output.line(outcome.group);
                group = outcome.group;
            }
            output.line(outcome.line());
        });
        let failed = outcomes.iter().filter(|outcome| !outcome.passed).count();
        output.line(format!("{}, {failed} not as expected", plural(outcomes.len() as u64, "case")));
        let cases: Value = outcomes.iter().map(Outcome::object).collect();
        output.object(&json!({ "cases": cases, "passed": outcomes.len() - failed, "failed": failed }));
        failed == 0
    }
}

/// Result of a case.
#[derive(Clone, Debug, PartialEq)]
struct Outcome {
    /// Kind of the case.
    group: &'static str,
    /// Name of the case.
    case: String,
    /// Known answer.
    expected: String,
    /// Measured answer.
    measured: String,
    /// True if both agree.
    passed: bool,
}

impl Outcome {
    fn line(&self) -> String {
        let Outcome { case, expected, measured, passed, .. } = self;
        let mark = if *passed { "as expected" } else { "NOT AS EXPECTED" };
        format!("  {case:<66} {expected:>16}  {measured:<28} {mark}")
    }

    fn object(&self) -> Value {
        json!({
            "group": self.group,
            "case": self.case,
            "expected": self.expected,
            "measured": self.measured,
            "passed": self.passed,
        })
    }
}

/// Runs the cases whose kind or name `is_selected`; `report` receives each result at once.
fn run(is_selected: &dyn Fn(&str) -> bool, report: &mut dyn FnMut(&Outcome)) -> Vec<Outcome> {
    let mut table = Table { is_selected, report, outcomes: Vec::new() };
    geometry::cases(&mut table);
    light::cases(&mut table);
    surfaces::cases(&mut table);
    view::cases(&mut table);
    kernels::cases(&mut table);
    derivatives::cases(&mut table);
    searches::cases(&mut table);
    table.outcomes
}

/// Table of results, which the cases fill.
struct Table<'a> {
    is_selected: &'a dyn Fn(&str) -> bool,
    report: &'a mut dyn FnMut(&Outcome),
    outcomes: Vec<Outcome>,
}

impl Table<'_> {
    fn selects(&self, group: &str, case: &str) -> bool {
        (self.is_selected)(group) || (self.is_selected)(case)
    }

    fn add(&mut self, outcome: Outcome) {
        (self.report)(&outcome);
        self.outcomes.push(outcome);
    }

    /// Case: the mean radiance of a picture is `expected`, and all its pixels are finite.
    fn radiance(&mut self, group: &'static str, case: impl Into<String>, scene: &TestScene, expected: f64) {
        self.radiance_within(group, case, scene, expected, ROUNDING);
    }

    /// [`Self::radiance`] with another relative `tolerance` in addition to the noise.
    fn radiance_within(
        &mut self,
        group: &'static str,
        case: impl Into<String>,
        scene: &TestScene,
        expected: f64,
        tolerance: f64,
    ) {
        let case = case.into();
        if !self.selects(group, &case) {
            return;
        }
        let (measured, passed) = match scene.measure() {
            Err(error) => (error, false),
            Ok(Measured { mean, error, rejected }) => {
                let tolerance = SIGMAS * error + tolerance * expected.abs();
                let passed = (mean - expected).abs() <= tolerance && rejected == 0;
                let rejected =
                    if rejected > 0 { format!(", {rejected} samples rejected") } else { String::new() };
                (format!("{} ± {}{rejected}", short(mean), short(error)), passed)
            }
        };
        self.add(Outcome { group, case, expected: short(expected), measured, passed });
    }

    /// Case: the largest error of a kernel, `measured`, is at most `most` ulp.
    fn units(&mut self, case: impl Into<String>, most: f64, measured: f64) {
        let case = case.into();
        if !self.selects("kernels", &case) {
            return;
        }
        self.add(Outcome {
            group: "kernels",
            case,
            expected: format!("at most {most} ulp"),
            measured: format!("{measured:.2} ulp"),
            passed: measured <= most,
        });
    }

    /// Case: none of `all` answers is wrong. Fewer than a thousand answers fail, as they prove little.
    fn exact(&mut self, case: impl Into<String>, wrong: u32, all: u32) {
        let case = case.into();
        if !self.selects("kernels", &case) {
            return;
        }
        let (expected, measured) = ("none wrong".into(), format!("{wrong} of {all} wrong"));
        self.add(Outcome { group: "kernels", case, expected, measured, passed: wrong == 0 && all > 1000 });
    }
}

/// Number with five digits.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e4).contains(&value.abs()) {
        let digits = 4 - value.abs().max(1e-3).log10().floor() as i32;
        return format!("{value:.*}", digits.clamp(0, 7) as usize);
    }
    format!("{value:.4e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_cases_have_their_known_answers() {
        let outcomes = run(&|_| true, &mut |_| {});
        let failed: Vec<_> = outcomes.iter().filter(|outcome| !outcome.passed).collect();
        assert!(failed.is_empty(), "{failed:#?}");
        assert!(outcomes.len() > 80, "{}", outcomes.len());
    }

    #[test]
    fn numbers_have_five_digits() {
        assert_eq!([0.0, 1.0, 123.456789, 0.0123].map(short), ["0.0000000", "1.0000", "123.46", "0.012300"]);
        assert_eq!(short(1e20), "1.0000e20");
    }
}
