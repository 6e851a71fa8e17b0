//! `halflight study radiance`: bases and derivatives of radiance caching.

use super::failure::Failure;
use super::stdio::print_result;
use clap::Args;
use halflight::render::{GradientError, study_gradients};
use serde_json::{Value, json};
use std::process::ExitCode;

/// Derivatives of radiance coefficients in rooms of known light
///
/// Gradients and Hessians of the coefficients from gather rays are compared with exact ones at points of a
/// floor, in rooms with and without a surface that hides others.
#[derive(Args)]
pub(super) struct Radiance {
    /// Strata along a side of the hemisphere
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "16,32,64",
        value_parser = clap::value_parser!(u8).range(4..=128))]
    strata: Vec<u8>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

impl Radiance {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let strata: Vec<usize> = self.strata.iter().map(|&n| n.into()).collect();
        let mut output = Output { json: self.json, printed: Ok(()) };
        let mut gradients = Vec::new();
        output.text(GRADIENTS);
        study_gradients(&strata, &mut |row| {
            output.text(&gradient_text(row));
            gradients.push(gradient_object(row));
        })
        .map_err(|error| Failure::new(error.to_string()))?;
        output.printed?;
        if self.json {
            print_result(&json!({ "gradients": gradients }).to_string())?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Lines of text, unless the output is JSON. The first failure is kept.
struct Output {
    json: bool,
    printed: Result<(), Failure>,
}

impl Output {
    fn text(&mut self, line: &str) {
        if !self.json && self.printed.is_ok() {
            self.printed = print_result(line);
        }
    }
}

/// Head of the table of derivatives.
const GRADIENTS: &str = "\
errors of derivatives, relative to their size; reflected: gradient of the light from metal of alpha 0.3
                                gradient of degree      Hessian of degree       reflected
room                    strata       0     2     4     6     0     2     4     6 borders  paper shifted";

fn gradient_text(row: &GradientError) -> String {
    let degrees = |errors: [f64; 4]| errors.map(|error| format!("{error:>6.3}")).concat();
    let [borders, analytic, displaced] = row.leaving;
    format!(
        "{:<27} {:>3} {}{} {:>7.3} {:>6.3} {:>7.3}",
        row.room,
        row.strata,
        degrees(row.gradient),
        degrees(row.hessian),
        borders,
        analytic,
        displaced,
    )
}

fn gradient_object(row: &GradientError) -> Value {
    let [borders, analytic, displaced] = row.leaving;
    json!({
        "room": row.room,
        "occluded": row.is_occluded,
        "strata": row.strata,
        "gradient": row.gradient,
        "hessian": row.hessian,
        "reflected": { "borders": borders, "analytic": analytic, "displaced": displaced },
    })
}
