//! `halflight compare`: errors of a picture against a reference, and pictures of the difference.

use super::failure::Failure;
use super::outputs::{Outputs, Role};
use super::read_picture;
use clap::Args;
use halflight::compare::{Comparison, Shown, compare, false_colours, working_bytes};
use halflight::memory::Budget;
use halflight::report::{comparison_object, file_name};
use halflight::save::Format;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Compare a picture with a reference: relMSE, MSE, RMSE and FLIP
///
/// relMSE is the mean over pixels and channels of (A - B)^2 / (B^2 + 0.01 m^2), with the mean m of B. relMSE,
/// MSE and RMSE are errors of linear radiance; PNG and JPEG are decoded from sRGB. FLIP is the LDR-FLIP error
/// (Andersson et al. 2020) of the sRGB pictures at 67 pixels per degree. Infinite and NaN pixels are left out
/// of the linear errors; without any other pixel all errors are NaN.
#[derive(Args)]
pub(super) struct Compare {
    /// Picture: EXR, HDR, PFM, PNG, JPEG, TIFF, WebP, BMP or TGA
    a: PathBuf,
    /// Reference, in the same formats
    b: PathBuf,
    /// Picture of the difference: values in linear formats, false colours in .png; may be repeated
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Kind of the difference [default: flip for .png, otherwise absolute]
    #[arg(long, requires = "output")]
    difference: Option<Shown>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

impl Compare {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let mut outputs = Outputs::new(self.json);
        let plan = self.output.iter().map(|file| self.plan(file, &mut outputs));
        let plan = plan.collect::<Result<Vec<_>, _>>()?;
        [&self.a, &self.b].into_iter().try_for_each(|picture| outputs.protect(picture))?;
        let mut budget = Budget::new(None);
        let (a, b) = (read_picture(&self.a, &mut budget)?, read_picture(&self.b, &mut budget)?);
        budget.has(working_bytes(&b)).map_err(|why| {
            Failure::new(format!("{} and {} cannot be compared: {why}", self.a.display(), self.b.display()))
        })?;
        let comparison = compare(&a, &b).map_err(|mismatch| {
            Failure::new(format!("{}: {mismatch}", self.a.display()))
                .advice("render both with the same --size; nothing is resampled")
        })?;
        let mut saved = Vec::new();
        for (file, shown) in plan {
            let values = comparison.values(&a, &b, shown);
            let (picture, scale) = if Format::of(file)?.is_linear() {
                (values, None)
            } else {
                let (colours, end) = false_colours(&values, shown);
                (colours, Some([if shown.is_signed() { -end } else { 0.0 }, end]))
            };
            if outputs.save(file, &picture) {
                saved.push(Saved { file, shown, scale });
            }
        }
        let results = if self.json {
            let mut object = comparison_object(&comparison);
            object["outputs"] = saved.iter().map(Saved::object).collect();
            object.to_string()
        } else {
            let lines = saved.iter().map(Saved::text);
            [text(&comparison)].into_iter().chain(lines).collect::<Vec<_>>().join("\n")
        };
        Ok(outputs.end(&results, ExitCode::SUCCESS))
    }

    /// Plans the output `file`, and determines its kind of difference.
    fn plan<'a>(&self, file: &'a PathBuf, outputs: &mut Outputs) -> Result<(&'a PathBuf, Shown), Failure> {
        outputs.plan(Role::Picture, file)?;
        let format = Format::of(file)?;
        let default = if format.is_linear() { Shown::Absolute } else { Shown::Flip };
        let difference = self.difference.unwrap_or(default);
        if format == Format::Hdr && difference.is_signed() {
            return Err(Failure::new(format!("{}: .hdr holds no values below zero", file.display()))
                .advice("write a signed difference as .exr, .pfm or .png"));
        }
        Ok((file, difference))
    }
}

/// Picture of the difference that was written.
struct Saved<'a> {
    file: &'a PathBuf,
    shown: Shown,
    /// Values of the first and the last false colour.
    scale: Option<[f32; 2]>,
}

impl Saved<'_> {
    fn object(&self) -> Value {
        json!({ "file": file_name(self.file), "difference": self.shown.name(), "scale": self.scale })
    }

    fn text(&self) -> String {
        let scale = self.scale.map(|[from, to]| format!(", colours from {from:.3e} to {to:.3e}"));
        let (file, name) = (self.file.display(), self.shown.name());
        format!("saved  {file}: {name} difference{}", scale.unwrap_or_default())
    }
}

/// Lines of a comparison.
pub(super) fn text(comparison: &Comparison) -> String {
    let linear = &comparison.linear;
    let ratio = match linear.reference_mean {
        reference if reference == 0.0 || reference.is_nan() => String::new(),
        reference => format!(" ({:+.3} %)", (linear.mean / reference - 1.0) * 100.0),
    };
    let mut text = format!(
        "relMSE {:.6e}\nMSE    {:.6e}\nRMSE   {:.6e}\nFLIP   {:.6}\nmean   {:.6} against {:.6}{ratio}",
        linear.relmse,
        linear.mse,
        linear.rmse(),
        comparison.flip,
        linear.mean,
        linear.reference_mean,
    );
    for (count, which) in [(linear.non_finite, "picture"), (linear.reference_non_finite, "reference")] {
        if count > 0 {
            text += &format!("\nleft out: {count} pixels of the {which} are infinite or not a number");
        }
    }
    text
}
