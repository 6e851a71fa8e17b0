//! Flags of the view that PNG files show.

use super::print_note;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use halflight::save::{Curve, Format, Image, ViewTransform, automatic_stops};
use std::borrow::Cow;
use std::path::PathBuf;

/// Exposure and curve of PNG files; other formats are linear.
#[derive(Args)]
pub(super) struct ViewArgs {
    /// Stops by which PNG files are brightened, or `auto`: their geometric mean becomes middle grey
    #[arg(long, value_name = "STOPS", default_value = "0", value_parser = exposure,
        allow_hyphen_values = true, help_heading = "Results")]
    exposure: Exposure,
    /// Curve of PNG files: colours above 1 are cut, or compressed as by Khronos PBR Neutral or AgX
    #[arg(long, value_name = "CURVE", default_value = "clamp", help_heading = "Results",
        value_parser = PossibleValuesParser::new(["clamp", "neutral", "agx"])
            .map(|name| name.parse::<Curve>().unwrap_or_default()))]
    view: Curve,
}

/// Value of `--exposure`.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Exposure {
    Stops(f32),
    Auto,
}

/// Largest exposure in stops, a factor of 1e18.
const MOST_STOPS: f32 = 60.0;

fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    let stops = text.parse::<f32>().ok().filter(|stops| stops.abs() <= MOST_STOPS);
    stops.map(Exposure::Stops).ok_or(format!("a number from -{MOST_STOPS} to {MOST_STOPS}, or `auto`"))
}

impl ViewArgs {
    /// True for another view than that of the values themselves.
    pub(super) fn is_given(&self) -> bool {
        self.exposure != Exposure::Stops(0.0) || self.view != Curve::default()
    }

    /// The picture as PNG files show it.
    pub(super) fn of<'i>(&self, image: &'i Image) -> Cow<'i, Image> {
        self.transform(image).shown(image)
    }

    fn transform(&self, image: &Image) -> ViewTransform {
        let stops = match self.exposure {
            Exposure::Stops(stops) => stops,
            Exposure::Auto => automatic_stops(image),
        };
        ViewTransform { stops, curve: self.view }
    }

    /// The picture as PNG files show it. Where one of `files` is a PNG that is nearly all black or burnt out,
    /// a note names an exposure that would show it.
    pub(super) fn shown<'i>(&self, image: &'i Image, files: &[PathBuf]) -> Cow<'i, Image> {
        let view = self.transform(image);
        let is_png = |file: &PathBuf| Format::of(file).is_ok_and(|format| !format.is_linear());
        if let Some(fault) = view.fault(image)
            && self.exposure != Exposure::Auto
            && files.iter().any(is_png)
        {
            print_note(format!(
                "the picture is nearly all {fault}: --exposure {} would show it",
                automatic_stops(image)
            ));
        }
        view.shown(image)
    }
}
