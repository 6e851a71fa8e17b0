//! `halflight study radiance`: bases and derivatives of radiance caching.

use super::failure::Failure;
use super::stdio::print_result;
use clap::{Args, ValueEnum};
use halflight::render::{ALPHAS, BasisError, GradientError, RenderError, study_bases, study_gradients};
use serde_json::{Map, Value, json};
use std::process::ExitCode;

/// Bases and derivatives of radiance coefficients in rooms of known light
///
/// Bases: light that metal of several roughnesses reflects from incident light, by the number of its
/// coefficients. Gradients: derivatives of coefficients from gather rays against exact ones, in rooms with
/// and without a surface that hides others.
#[derive(Args)]
pub(super) struct Radiance {
    /// Parts of the study [default: all]
    #[arg(long, value_name = "PART,...", value_delimiter = ',', value_enum)]
    parts: Vec<Part>,
    /// Strata along a side of the hemisphere
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "16,32,64",
        value_parser = clap::value_parser!(u8).range(4..=128))]
    strata: Vec<u8>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

/// Part of the study.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Part {
    Bases,
    Gradients,
}

impl Radiance {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let strata: Vec<usize> = self.strata.iter().map(|&n| n.into()).collect();
        let mut output = Output { json: self.json, printed: Ok(()) };
        let has = |part| self.parts.is_empty() || self.parts.contains(&part);
        let failure = |error: RenderError| Failure::new(error.to_string());
        let mut object = Map::new();
        if has(Part::Bases) {
            output.text(&bases_head());
            let bases = study_bases().map_err(failure)?;
            bases.iter().for_each(|row| output.text(&basis_text(row)));
            object.insert("bases".to_owned(), bases.iter().map(basis_object).collect());
        }
        if has(Part::Gradients) {
            let mut rows = Vec::new();
            output.text(GRADIENTS);
            study_gradients(&strata, &mut |row| {
                output.text(&gradient_text(row));
                rows.push(gradient_object(row));
            })
            .map_err(failure)?;
            object.insert("gradients".to_owned(), rows.into());
        }
        output.printed?;
        if self.json {
            print_result(&Value::Object(object).to_string())?;
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

/// Head of the table of bases.
fn bases_head() -> String {
    let alphas = ALPHAS.map(|alpha| format!("{:>14}", format!("alpha {alpha:.1}"))).concat();
    format!(
        "errors of light from metal, relative to its size, for viewers at 5 to 62 and at 72 to 80 degrees\n\
         basis    degree coefficients{alphas}"
    )
}

fn basis_text(row: &BasisError) -> String {
    let errors = row.errors.map(|[common, grazing]| format!("{common:>7.4}{grazing:>7.4}")).concat();
    format!("{:<8} {:>6} {:>12}{errors}", row.basis, row.degree, row.count)
}

fn basis_object(row: &BasisError) -> Value {
    let error = |(alpha, [common, grazing]): (f32, [f64; 2])| json!({ "alpha": alpha, "common": common, "grazing": grazing });
    let errors: Vec<_> = ALPHAS.into_iter().zip(row.errors).map(error).collect();
    json!({ "basis": row.basis, "degree": row.degree, "coefficients": row.count, "errors": errors })
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
