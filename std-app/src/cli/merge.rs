//! `halflight merge`: a picture from the films of all shards, or tables from bakes.

use super::bake_files::{BakeFiles, check_no_error_map};
use super::failure::Failure;
use super::layer_args::LayerArgs;
use super::outputs::{Outputs, Picture, Role};
use super::view_args::ViewArgs;
use super::{summary, values};
use clap::Args;
use halflight::bake;
use halflight::layers::{Facts, LayerSource};
use halflight::render::{self, Merged};
use halflight::report::{Provenance, dropped_object, error_object, file_name, findings_object};
use halflight::save::ExrFile;
use halflight::values::TargetError;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Merge the films of all shards of a picture, or of a bake
///
/// The films come from `halflight render --shard I/N --checkpoint FILE` or from `halflight bake` with these
/// flags, in any order. Picture and tables have the bits of one render or bake. Films of different scenes,
/// settings or numbers of samples are refused.
#[derive(Args)]
pub(super) struct Merge {
    /// Films, one of each shard
    #[arg(required = true)]
    films: Vec<PathBuf>,
    /// Picture: .png, .exr, .hdr or .pfm; of a bake its table (.csv, .res or .ply), lightmap (.exr, .hdr or
    /// .pfm) or probes (.json, .csv or .ktx2); may be repeated
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    #[command(flatten)]
    view: ViewArgs,
    /// Add the samples per pixel that relMSE needs to fall to this value, of pictures of the same settings
    #[arg(long, value_name = "RELMSE", value_parser = values::checked::<f64, TargetError>)]
    for_error: Option<TargetError>,
    /// Map of the half-widths of the intervals of a lightmap: .exr, .hdr or .pfm
    #[arg(long, value_name = "FILE")]
    error_map: Option<PathBuf>,
    #[command(flatten)]
    layers: LayerArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

impl Merge {
    pub(super) fn run(&self) -> Result<ExitCode, Failure> {
        if self.films.first().is_some_and(|film| bake::is_bake(film)) {
            return self.run_bake();
        }
        check_no_error_map(self.error_map.as_deref())?;
        let mut outputs = Outputs::new(self.json);
        self.output.iter().try_for_each(|output| outputs.plan(Role::Picture, output))?;
        self.films.iter().try_for_each(|film| outputs.protect(film))?;
        self.layers.check(&self.output)?;
        let merged = render::merge_with(&self.films, &self.layers.of_films()?)?;
        let shown = self.view.shown(&merged.image, &self.output);
        let provenance = Provenance::here();
        let Merged { variance, samples, layers, .. } = &merged;
        let layers = LayerSource { variance, samples, layers, scene: None };
        self.layers.note_missing(&layers);
        let exr = || {
            let mut file = ExrFile::of(&merged.image);
            Facts::of_merged(&merged, &provenance).add_to(&mut file);
            self.layers.add_to(&mut file, &layers);
            file
        };
        let picture = Picture { image: &merged.image, shown: &shown, exr: &exr };
        let saved = outputs.save_to(&self.output, &picture);
        let (object, text) = (|| self.object(&merged, &saved), || self.text(&merged, &saved));
        Ok(outputs.end_with(object, text, ExitCode::SUCCESS))
    }

    /// Merges bakes.
    fn run_bake(&self) -> Result<ExitCode, Failure> {
        let of_pictures = [
            ("--aov", self.layers.is_given()),
            ("--exposure or --view", self.view.is_given()),
            ("--for-error", self.for_error.is_some()),
        ];
        if let Some((flag, _)) = of_pictures.iter().find(|(_, is_given)| *is_given) {
            let message = format!("{flag} is for pictures, and these films are parts of a bake");
            return Err(Failure::new(message).advice("leave it out"));
        }
        let mut outputs = Outputs::new(self.json);
        let merged = bake::merge(&self.films)?;
        let files = BakeFiles::new(&merged.subject, (&self.output, self.error_map.as_deref()))?;
        files.plan(&mut outputs)?;
        self.films.iter().try_for_each(|film| outputs.protect(film))?;
        let saved = files.save(&mut outputs, &merged);
        let baked = &merged.baked;
        let spp = baked.values.iter().map(|value| value.samples).min().unwrap_or_default();
        let head = saved.as_ref().map_or(String::new(), ToString::to_string);
        let object = || {
            let mut object = json!({
                "points": baked.values.len(),
                "shards": self.films.len(),
                "spp": spp,
                "half_width": baked.median_half_width(),
                "mean": baked.mean(),
                "seconds": { "sampling": baked.seconds[1] },
                "rays": baked.counters.all_rays(),
                "paths": baked.counters.paths,
                "outputs": self.output.iter().map(|file| file_name(file)).collect::<Value>(),
            });
            if let Some(saved) = saved {
                saved.add_to(&mut object);
            }
            object
        };
        let text = || format!("{head}{} points, {spp} samples each", baked.values.len());
        Ok(outputs.end_with(object, text, ExitCode::SUCCESS))
    }

    fn object(&self, merged: &Merged, saved: &[&PathBuf]) -> Value {
        let counters = &merged.counters;
        json!({
            "width": merged.image.width,
            "height": merged.image.height,
            "shards": self.films.len(),
            "spp": merged.spp,
            "seconds": { "render": merged.seconds },
            "rays": counters.all_rays(),
            "shadow_rays": counters.shadow_rays,
            "paths": counters.paths,
            "mean_radiance": merged.image.mean(),
            "spp_for_error": self.samples_needed(merged).map(|needed| needed.ok()),
            "error": error_object(merged.error, merged.noise_and_blur, merged.audit.as_ref()),
            "may_be_biased": merged.is_biased,
            "findings": findings_object(&merged.findings),
            "dropped": dropped_object(&counters.dropped, &merged.rejected_tiles, merged.empty_pixels),
            "outputs": saved.iter().map(|file| file_name(file)).collect::<Value>(),
        })
    }

    /// Samples per pixel for the error of `--for-error`, or the reason why there is no number.
    fn samples_needed(&self, merged: &Merged) -> Option<Result<u64, &'static str>> {
        let wanted = f64::from(self.for_error?);
        let Some(error) = merged.error else { return Some(Err("the error of this picture is unknown")) };
        // Bias does not fall with more samples; noise falls as 1 / n.
        let bias = merged.audit.as_ref().map_or(0.0, |audit| audit.bias.upper.max(0.0));
        let noise = (error.upper - bias).max(0.0);
        Some(match wanted > bias {
            true => Ok((f64::from(merged.spp) * (noise / (wanted - bias)) / 4.0).ceil() as u64 * 4),
            false => Err("the bias of the method alone may be larger"),
        })
    }

    fn text(&self, merged: &Merged, saved: &[&PathBuf]) -> String {
        let mut lines: Vec<_> = saved.iter().map(|output| format!("saved  {}", output.display())).collect();
        let (width, height) = (merged.image.width, merged.image.height);
        lines.push(format!("image  {width}x{height}, {} samples per pixel", merged.spp));
        lines.extend(self.samples_needed(merged).map(|needed| match needed {
            Ok(samples) => {
                format!("       {samples} samples per pixel are needed for the error of --for-error")
            }
            Err(reason) => format!("       no number of samples is known for --for-error: {reason}"),
        }));
        match &merged.audit {
            Some(audit) => lines.extend(summary::audited(audit)),
            None => lines.extend(summary::estimate(
                merged.error,
                merged.noise_and_blur,
                (merged.is_biased, &merged.findings),
            )),
        }
        lines.extend(merged.findings.iter().map(|finding| format!("       {}", summary::finding(finding))));
        lines.extend(summary::rejected(&merged.counters, &merged.rejected_tiles, merged.empty_pixels));
        lines.join("\n")
    }
}
