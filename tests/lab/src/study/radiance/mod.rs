//! Bases and derivatives of radiance caching in rooms of known light: bases of incident radiance by the error
//! of reflected light, derivatives of coefficients against exact ones, error metrics at equal numbers of
//! records, and times.

mod bases;
mod degrees;
mod gradients;
mod metrics;
mod picture;
mod polygons;
mod rooms;
mod times;

use crate::Result;
use crate::output::Output;
use clap::{Args, ValueEnum};
use halflight::save;
use halflight_core::cache::irradiance::Hemisphere;
use halflight_core::memory::OutOfMemory;
use halflight_test_support::GatherRays;
use serde_json::{Map, Value};
use std::path::PathBuf;

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
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
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
    pub(super) fn run(&self, output: &mut Output) -> Result<()> {
        let strata: Vec<usize> = self.strata.iter().map(|&n| n.into()).collect();
        let has = |part| self.parts.is_empty() || self.parts.contains(&part);
        let mut tables = Tables { output, object: Map::new() };
        if has(Part::Bases) {
            tables.add("bases", bases::measure)?;
        }
        if has(Part::Gradients) {
            tables.add("gradients", |each| gradients::measure(&strata, each))?;
        }
        if has(Part::Degrees) {
            tables.add("degrees", degrees::measure)?;
        }
        if has(Part::Metrics) {
            tables.add("metrics", metrics::measure)?;
        }
        if let Some(path) = &self.picture {
            save::write(path, &picture::picture()?)?;
        }
        if has(Part::Times) {
            tables.add("times", times::measure)?;
        }
        let Tables { output, object } = tables;
        output.object(&Value::Object(object));
        Ok(())
    }
}

/// Row of the table of a part.
trait Row {
    /// Title and head of the table.
    fn head() -> String;
    fn line(&self) -> String;
    fn object(&self) -> Value;
}

/// Tables of the parts, whose rows are written as they come.
struct Tables<'a, 'o> {
    output: &'a mut Output<'o>,
    object: Map<String, Value>,
}

impl Tables<'_, '_> {
    /// Adds the table of a part; `measure` calls its argument with each row.
    fn add<R: Row>(
        &mut self,
        part: &str,
        measure: impl FnOnce(&mut dyn FnMut(&R)) -> core::result::Result<(), OutOfMemory>,
    ) -> Result<()> {
        self.output.line(R::head());
        let mut rows = Vec::new();
        measure(&mut |row| {
            self.output.line(row.line());
            rows.push(row.object());
        })?;
        self.object.insert(part.to_owned(), rows.into());
        Ok(())
    }
}

/// Hemisphere of gather rays.
fn hemisphere(rays: &GatherRays) -> Option<Hemisphere<'_>> {
    let GatherRays { strata, radiance, inverse, directions, normals } = rays;
    Hemisphere::new(*strata, radiance, inverse, directions)?.with_normals(normals)
}
