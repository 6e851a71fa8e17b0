//! The developers' program: timed kernels beside other libraries, cases with known answers, and studies of
//! parts of methods. `cargo lab bench rays SCENE`, `cargo lab stability`, `cargo lab study radiance`;
//! docs/lab.md describes its commands.
#![forbid(unsafe_code)]

mod bench;
mod flags;
mod output;
mod stability;
mod study;

use clap::{Parser, Subcommand};
use core::error::Error;
use output::Output;
use std::io::{Write, stdout};
use std::process::ExitCode;

/// Measures and examines the parts of halflight.
#[derive(Parser)]
#[command(name = "lab", max_term_width = 100, arg_required_else_help = true)]
struct Lab {
    #[command(subcommand)]
    command: Command,
    /// Print one JSON object instead of text
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Command {
    Bench(bench::Bench),
    Stability(stability::Stability),
    Study(study::Study),
}

type Result<T> = core::result::Result<T, Box<dyn Error>>;

impl Lab {
    /// Writes the results to `to`; false if an answer is not the known one.
    fn run(&self, to: &mut dyn Write) -> Result<bool> {
        let mut output = Output::new(self.json, to);
        let is_as_expected = match &self.command {
            Command::Bench(bench) => bench.run(&mut output).map(|()| true)?,
            Command::Stability(stability) => stability.run(&mut output),
            Command::Study(study) => study.run(&mut output).map(|()| true)?,
        };
        output.written()?;
        Ok(is_as_expected)
    }
}

fn main() -> ExitCode {
    match Lab::parse().run(&mut stdout()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    const CORNELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/cornell/cornell.obj");

    /// Text that a command prints, and whether its answers are the known ones.
    fn run(line: &str) -> Result<(String, bool)> {
        let mut text = Vec::new();
        let lab = Lab::try_parse_from(["lab"].into_iter().chain(line.split_whitespace()))?;
        let is_as_expected = lab.run(&mut text)?;
        Ok((String::from_utf8(text)?, is_as_expected))
    }

    /// Object that a command prints with `--json`.
    fn object(line: &str) -> Value {
        serde_json::from_str(&run(&format!("{line} --json")).unwrap().0).unwrap()
    }

    #[test]
    fn bench_rays_measures_the_cornell_box() {
        let line = "--eye 278,273,-800 --look-at 278,273,0 --fov 39.3 --simd baseline";
        let cornell = object(&format!("bench rays {CORNELL} {line}"));
        assert_eq!(cornell["level"], "baseline");
        assert!(cornell["build_seconds"].as_f64().unwrap() > 0.0);
        assert!(cornell["bytes_per_triangle"].as_f64().unwrap() > 36.0, "three corners at least");
        for class in ["primary", "diffuse", "shadow"] {
            assert!(cornell["mrays_per_second"][class].as_f64().unwrap() > 0.0, "{class}");
        }
        assert_eq!(cornell["rays"]["primary"], 1024 * 1024);
        assert_eq!(cornell["hits"]["primary"], cornell["rays"]["diffuse"], "one bounce from each hit");

        // Neither side is a multiple of a tile.
        let small = object(&format!("bench rays {CORNELL} --size 37x21 --simd baseline"));
        assert_eq!((&small["width"], &small["height"]), (&37.into(), &21.into()));
        assert_eq!(small["rays"]["primary"], 37 * 21);
        assert_eq!(small["hits"]["primary"], small["rays"]["diffuse"]);
        assert_eq!(small["rays"]["shadow"], small["rays"]["diffuse"]);

        let away = object(&format!("bench rays {CORNELL} --eye 0,0,9e3 --look-at 0,0,1e4 --size 8x8"));
        assert_eq!(away["hits"]["primary"], 0);
        assert!(away["mrays_per_second"]["diffuse"].is_null(), "no rays, no speed");
    }

    #[test]
    fn stability_prints_its_table() {
        let grazing = object("stability --only grazing");
        assert_eq!((grazing["passed"].as_u64(), grazing["failed"].as_u64()), (Some(7), Some(0)));
        for key in ["group", "case", "expected", "measured", "passed"] {
            assert!(!grazing["cases"][0][key].is_null(), "{key}");
        }
        let (text, is_as_expected) = run("stability --only grazing").unwrap();
        assert!(text.contains("7 cases, 0 not as expected") && is_as_expected, "{text}");
    }

    #[test]
    fn study_irradiance_compares_metrics_at_equal_numbers_of_records() {
        let line = "--records 200 --metrics halflight,split-sphere --points 60 --size 64x64 --threads 2";
        let study = object(&format!("study irradiance {CORNELL} {line}"));
        assert_eq!(study["records"], 200);
        for row in study["metrics"].as_array().unwrap() {
            let number = |key: &str| row[key].as_f64().unwrap();
            assert!((number("records") / 200.0 - 1.0).abs() < 0.1, "{row}");
            assert!(number("rmse") < 0.5 && number("achieved") > 0.0 && number("covered") > 0.9, "{row}");
        }
    }

    #[test]
    fn study_reconstruction_compares_with_a_reference() {
        let view = "--eye 278,273,-800 --look-at 278,273,0 --fov 39.3";
        let study = object(&format!(
            "study reconstruction {CORNELL} {view} --size 64x64 --spp 16 --reference-spp 256 --threads 2"
        ));
        let number = |key: &str| study["pictures"][0][key].as_f64().unwrap();
        assert!(
            number("reconstructed") < number("raw") && number("reference") < 0.2 * number("raw"),
            "{study}"
        );
        assert!((number("estimated_raw") / number("raw") - 1.0).abs() < 0.3, "{study}");
    }

    #[test]
    fn bad_input_is_refused_with_its_reason() {
        for (line, reason) in [
            ("bench", "rays"),
            ("bench rays missing.obj", "missing.obj"),
            ("bench rays scene.obj --size 0x9", "640x480"),
            ("bench rays scene.obj --eye 1,2", "three numbers"),
            ("bench eigen --simd mmx", "baseline, avx2, avx512"),
            ("study irradiance missing.toml", "missing.toml"),
            ("study radiance --strata 2", "4..=128"),
        ] {
            let said = run(line).unwrap_err().to_string();
            assert!(said.contains(reason), "{line}: {said}");
        }
        let same = run(&format!("bench rays {CORNELL} --eye 1,2,3 --look-at 1,2,3")).unwrap_err().to_string();
        assert!(same.contains("the same point"), "{same}");
    }
}
