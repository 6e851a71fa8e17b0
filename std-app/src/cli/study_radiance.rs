//! `halflight study radiance`: bases and derivatives of radiance caching.

use super::failure::Failure;
use super::stdio::print_result;
use clap::{Args, ValueEnum};
use halflight::render::{
    ALPHAS, BasisError, GradientError, LobeDegrees, RadianceMetricError, RadianceTimes, RenderError,
    STUDY_ANGLES, STUDY_RECORDS, picture_of_radiance_metrics, study_bases, study_gradients,
    study_lobe_degrees, study_radiance_metrics, study_radiance_times,
};
use halflight::save;
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Bases, derivatives, metrics and times of radiance coefficients in rooms of known light
///
/// Bases: light that metal of several roughnesses reflects from incident light, by the number of its
/// coefficients. Gradients: derivatives of coefficients from gather rays against exact ones, in rooms with
/// and without a surface that hides others. Degrees: those of lobes within a tolerance. Metrics: error
/// between records of the light from metal, by rules for the radii at equal numbers of records. Times:
/// look-ups, and coefficients of a record.
#[derive(Args)]
pub(super) struct Radiance {
    /// Parts of the study [default: all]
    #[arg(long, value_name = "PART,...", value_delimiter = ',', value_enum)]
    parts: Vec<Part>,
    /// Strata along a side of the hemisphere
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "16,32,64",
        value_parser = clap::value_parser!(u8).range(4..=128))]
    strata: Vec<u8>,
    /// Picture of errors and records on a floor by two metrics, 150 records each
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    picture: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long, help_heading = "Results")]
    json: bool,
}

/// Part of the study.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Part {
    Bases,
    Gradients,
    Degrees,
    Metrics,
    Times,
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
        if has(Part::Degrees) {
            output.text(&degrees_head());
            let degrees = study_lobe_degrees().map_err(failure)?;
            degrees.iter().for_each(|row| output.text(&degrees_text(row)));
            object.insert("degrees".to_owned(), degrees.iter().map(degrees_object).collect());
        }
        if has(Part::Metrics) {
            let mut rows = Vec::new();
            output.text(&metrics_head());
            study_radiance_metrics(&mut |row| {
                output.text(&metric_text(row));
                rows.push(metric_object(row));
            })
            .map_err(failure)?;
            object.insert("metrics".to_owned(), rows.into());
        }
        if let Some(path) = &self.picture {
            let picture = picture_of_radiance_metrics().map_err(failure)?;
            save::write(path, &picture).map_err(|error| Failure::new(error.to_string()))?;
        }
        if has(Part::Times) {
            output.text(TIMES);
            let times = study_radiance_times().map_err(failure)?;
            times.iter().for_each(|row| output.text(&time_text(row)));
            object.insert("times".to_owned(), times.iter().map(time_object).collect());
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

/// Head of the table of degrees.
fn degrees_head() -> String {
    let angles = STUDY_ANGLES.map(|angle| format!("{angle:>4.0}")).concat();
    format!(
        "lowest degree of metal within an expected error, by angle of the viewer\nbasis    alpha error{angles}"
    )
}

fn degrees_text(row: &LobeDegrees) -> String {
    let degree = |degree: Option<usize>| degree.map_or("-".to_owned(), |degree| degree.to_string());
    let degrees = row.degrees.map(|found| format!("{:>4}", degree(found))).concat();
    format!("{:<8} {:>5.2} {:>5.2}{degrees}", row.basis.name(), row.alpha, row.tolerance)
}

fn degrees_object(row: &LobeDegrees) -> Value {
    let degrees: Vec<_> = STUDY_ANGLES
        .into_iter()
        .zip(row.degrees)
        .map(|(angle, degree)| json!({ "angle": angle, "degree": degree }))
        .collect();
    json!({ "basis": row.basis.name(), "alpha": row.alpha, "tolerance": row.tolerance, "degrees": degrees })
}

/// Head of the table of metrics.
fn metrics_head() -> String {
    let counts = STUDY_RECORDS.map(|count| format!("{count:>8}")).concat();
    format!(
        "error of light from metal of alpha 0.3 between records, over the mean light, by number of records\n\
         room     basis    radii                       {counts}   at records"
    )
}

fn metric_text(row: &RadianceMetricError) -> String {
    let errors = row.errors.map(|error| format!("{error:>8.4}")).concat();
    format!("{:<8} {:<8} {:<28}{errors}     {:>8.4}", row.room, row.basis.name(), row.rule, row.own)
}

fn metric_object(row: &RadianceMetricError) -> Value {
    let errors: Vec<_> = STUDY_RECORDS
        .into_iter()
        .zip(row.errors)
        .map(|(records, error)| json!({ "records": records, "error": error }))
        .collect();
    json!({
        "room": row.room,
        "basis": row.basis.name(),
        "radii": row.rule,
        "errors": errors,
        "at_records": row.own,
    })
}

/// Head of the table of times.
const TIMES: &str = "\
times: of a look-up in ns, of a record of 1024 rays in µs
basis    degree  bytes  10 records     lobe rotation  projection gradients irradiance";

fn time_text(row: &RadianceTimes) -> String {
    let rotation = row.rotation.map_or("-".to_owned(), |rotation| format!("{rotation:.0}"));
    format!(
        "{:<8} {:>6} {:>6} {:>11.0} {:>8.0} {rotation:>8} {:>11.1} {:>9.1} {:>10.1}",
        row.basis.name(),
        row.degree,
        row.bytes,
        row.records,
        row.lobe,
        row.projection,
        row.gradients,
        row.irradiance,
    )
}

fn time_object(row: &RadianceTimes) -> Value {
    json!({
        "basis": row.basis.name(),
        "degree": row.degree,
        "bytes": row.bytes,
        "records_ns": row.records,
        "lobe_ns": row.lobe,
        "rotation_ns": row.rotation,
        "projection_us": row.projection,
        "gradients_us": row.gradients,
        "irradiance_us": row.irradiance,
    })
}
