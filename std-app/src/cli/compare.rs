//! `halflight compare`: two picture files, their errors, and a picture of the difference.

use super::failure::Failure;
use super::say;
use clap::Args;
use halflight::compare::{Comparison, compare};
use halflight::save::{self, Format};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Compare a picture with a reference: relMSE, MSE, RMSE and FLIP
///
/// relMSE is the mean over pixels and channels of (A - B)^2 / (B^2 + 0.01 m^2), m the mean of B. It, MSE
/// and RMSE are taken in linear light (PNGs go back through the sRGB curve). FLIP is LDR-FLIP (Andersson et
/// al. 2020) of the pictures as a PNG shows them, at 67 pixels per degree. Pixels that are infinite or not
/// a number are left out of the linear errors, and counted.
#[derive(Args)]
pub(super) struct Compare {
    /// The picture (.exr, .hdr, .pfm or .png)
    a: PathBuf,
    /// The reference (.exr, .hdr, .pfm or .png)
    b: PathBuf,
    /// Also write a picture of the difference: |A - B|, or, as .png, the FLIP map in false colours
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

impl Compare {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        if let Some(output) = &self.output {
            save::check_writable(output)?;
        }
        let (a, b) = (save::read(&self.a)?, save::read(&self.b)?);
        let comparison = compare(&a, &b).map_err(|mismatch| {
            Failure::new(format!("{}: {mismatch}", self.a.display()))
                .advice("render both with the same --size; nothing is resampled")
        })?;
        if let Some(output) = &self.output {
            save::write(output, &comparison.picture(&a, &b, Format::of(output)?))?;
        }
        say(&if self.json { object(&comparison).to_string() } else { text(&comparison) });
        Ok(ExitCode::SUCCESS)
    }
}

/// The object of `--json`. Errors that are infinite are `null`: JSON has no infinity.
pub(super) fn object(comparison: &Comparison) -> Value {
    let linear = &comparison.linear;
    json!({
        "width": comparison.width,
        "height": comparison.height,
        "relmse": linear.relmse,
        "mse": linear.mse,
        "rmse": linear.rmse(),
        "flip": comparison.flip,
        "mean": linear.mean,
        "reference_mean": linear.reference_mean,
        "non_finite": linear.non_finite,
        "reference_non_finite": linear.reference_non_finite,
    })
}

/// The lines for a person.
pub(super) fn text(comparison: &Comparison) -> String {
    let linear = &comparison.linear;
    let mut text = format!(
        "relMSE {:.6e}\nMSE    {:.6e}\nRMSE   {:.6e}\nFLIP   {:.6}\nmean   {:.6} against {:.6}{}",
        linear.relmse,
        linear.mse,
        linear.rmse(),
        comparison.flip,
        linear.mean,
        linear.reference_mean,
        ratio(linear.mean, linear.reference_mean),
    );
    for (count, which) in [(linear.non_finite, "picture"), (linear.reference_non_finite, "reference")] {
        if count > 0 {
            text += &format!("\nleft out: {count} pixels of the {which} are infinite or not a number");
        }
    }
    text
}

fn ratio(mean: f64, reference: f64) -> String {
    if reference == 0.0 { String::new() } else { format!(" ({:+.3} %)", (mean / reference - 1.0) * 100.0) }
}
