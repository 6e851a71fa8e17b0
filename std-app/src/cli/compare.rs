//! `halflight compare`: two picture files, their errors, and a picture of the difference.

use super::failure::Failure;
use super::outputs::{Outputs, Role};
use super::read_picture;
use clap::{Args, ValueEnum};
use halflight::compare::{Comparison, Shown, compare, false_colours, working_bytes};
use halflight::memory::Budget;
use halflight::report::comparison_object;
use halflight::save::Format;
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
    /// The picture, of any format that is read: EXR, HDR, PFM, PNG, JPEG, TIFF, WebP, BMP, TGA
    a: PathBuf,
    /// The reference, likewise
    b: PathBuf,
    /// Also write a picture of the difference: its values, or, as .png, in false colours; may be given
    /// several times
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// What it shows [default: flip as .png, absolute in the linear formats]
    #[arg(long, requires = "output")]
    difference: Option<Difference>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Difference {
    /// A - B; as .png blue where A is too dark, red where it is too bright
    Signed,
    /// |A - B|
    Absolute,
    /// (A - B) / sqrt(B^2 + 0.01 m^2), whose mean square is the relMSE
    Relative,
    /// The FLIP error of each pixel
    Flip,
}

impl Compare {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        let mut outputs = Outputs::new(self.json);
        let plan = self.output.iter().map(|file| self.plan(file, &mut outputs));
        let plan = plan.collect::<Result<Vec<_>, _>>()?;
        [&self.a, &self.b].into_iter().try_for_each(|picture| outputs.spare(picture))?;
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
        let results =
            if self.json { told(&comparison, &saved).to_string() } else { page(&comparison, &saved) };
        Ok(outputs.end(&results, ExitCode::SUCCESS))
    }

    /// What `file` is going to show, where that can be written.
    fn plan<'a>(&self, file: &'a PathBuf, outputs: &mut Outputs) -> Result<(&'a PathBuf, Shown), Failure> {
        outputs.plan(Role::Picture, file)?;
        let format = Format::of(file)?;
        let shown = match self.difference {
            Some(Difference::Signed) => Shown::Signed,
            Some(Difference::Absolute) => Shown::Absolute,
            Some(Difference::Relative) => Shown::Relative,
            Some(Difference::Flip) => Shown::Flip,
            None if format.is_linear() => Shown::Absolute,
            None => Shown::Flip,
        };
        if format == Format::Hdr && shown.is_signed() {
            return Err(Failure::new(format!("{}: .hdr holds no values below zero", file.display()))
                .advice("write a signed difference as .exr, .pfm or .png"));
        }
        Ok((file, shown))
    }
}

/// A picture of the difference that was written.
struct Saved<'a> {
    file: &'a PathBuf,
    shown: Shown,
    /// The values of the first and the last of its false colours.
    scale: Option<[f32; 2]>,
}

impl Saved<'_> {
    fn name(&self) -> &'static str {
        match self.shown {
            Shown::Signed => "signed",
            Shown::Absolute => "absolute",
            Shown::Relative => "relative",
            Shown::Flip => "flip",
        }
    }
}

fn told(comparison: &Comparison, saved: &[Saved]) -> Value {
    let mut object = comparison_object(comparison);
    let outputs = saved
        .iter()
        .map(|saved| json!({ "file": saved.file, "difference": saved.name(), "scale": saved.scale }));
    object["outputs"] = outputs.collect();
    object
}

fn page(comparison: &Comparison, saved: &[Saved]) -> String {
    saved.iter().fold(text(comparison), |text, saved| {
        let scale = saved.scale.map(|[from, to]| format!(", colours from {from:.3e} to {to:.3e}"));
        let scale = scale.unwrap_or_default();
        format!("{text}\nsaved  {}: {} difference{scale}", saved.file.display(), saved.name())
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
