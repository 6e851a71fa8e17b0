//! Lightmaps by `halflight bake`.

use super::{Bake, check_outputs, code, memory};
use crate::cli::bake_files::MapFiles;
use crate::cli::failure::Failure;
use crate::cli::interrupt::INTERRUPT;
use crate::cli::outputs::Outputs;
use crate::cli::progress::ProgressReporter;
use crate::cli::{print_note, values};
use clap::{Args, ValueEnum};
use core::sync::atomic::Ordering;
use halflight::bake::{DirectionalLayout, Lightmap, LightmapError, LightmapSettings};
use halflight::load::LoadOptions;
use halflight::report::file_name;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Rings of texels around charts without `--pad`: enough for bilinear fetches of two mip levels.
const PADDING: u32 = 4;

/// Subjects of other runs, in which flags of a lightmap have no meaning.
const OTHERS: [&str; 3] = ["points", "vertices", "probes"];

#[derive(Args)]
pub(super) struct LightmapArgs {
    /// Lightmap of a mesh, by the name of its file, of an object, by its `o` or `g` or node, of a material,
    /// or of `all`, in the texture coordinates of the files
    #[arg(long, value_name = "NAME", requires = "size")]
    lightmap: Option<String>,
    /// Width and height of the lightmap in texels
    #[arg(long, value_name = "WxH", value_parser = values::size, conflicts_with_all = OTHERS)]
    size: Option<[u32; 2]>,
    /// Map of the half-widths of the intervals: .exr, .hdr or .pfm
    #[arg(long, value_name = "FILE", conflicts_with_all = OTHERS)]
    error_map: Option<PathBuf>,
    /// Rings of texels around charts that take the values of their neighbours [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=4096),
          conflicts_with_all = OTHERS)]
    pad: Option<u32>,
    /// Points of each texel; the value is their mean [default: 1, its centre]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=256),
          conflicts_with_all = OTHERS)]
    supersample: Option<u32>,
    /// Irradiance as a linear function a + b·n of the normal: four layers, one below the other
    #[arg(long, value_name = "LAYOUT", num_args = 0..=1, require_equals = true,
          default_missing_value = "linear", conflicts_with_all = OTHERS)]
    directional: Option<Layout>,
}

/// Layers of a directional lightmap.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Layout {
    /// a, and b along x, y and z
    Linear,
    /// Those of Godot
    Godot,
}

impl LightmapArgs {
    /// The run of a lightmap; `None` for other subjects.
    pub(super) fn run(&self, bake: &Bake) -> Option<Result<ExitCode, Failure>> {
        Some(self.run_lightmap(bake, (self.lightmap.as_ref()?, self.size?)))
    }

    fn run_lightmap(&self, bake: &Bake, (subject, size): (&str, [u32; 2])) -> Result<ExitCode, Failure> {
        let mut outputs = Outputs::new(bake.json);
        let settings = LightmapSettings {
            subject: (subject != "all").then(|| subject.to_owned()),
            size,
            points: self.supersample.unwrap_or(1),
            padding: self.pad.unwrap_or(PADDING),
            directional: self.directional.is_some(),
            layout: match self.directional {
                Some(Layout::Godot) => DirectionalLayout::Godot,
                Some(Layout::Linear) | None => DirectionalLayout::Linear,
            },
        };
        let files = MapFiles::new(&bake.output, self.error_map.as_deref(), settings.is_signed())?;
        files.plan(&mut outputs)?;
        bake.parts.plan(&mut outputs)?;
        check_outputs(bake, "--lightmap", "-o map.exr")?;
        let options = LoadOptions { memory: bake.memory, keeps_texcoords: true, ..LoadOptions::default() };
        let loaded = bake.load(&outputs, &options)?;
        let mut memory = memory(bake, &loaded);
        let before = memory.left();
        let start = Instant::now();
        let mut reporter = ProgressReporter::new();
        let mut watch = |done: f64| {
            let text = format!("points of texels, {:.0} %", 100.0 * done);
            reporter.report_text((&text, json!({ "samples": 0 })), start.elapsed().as_secs_f64(), None);
            !INTERRUPT.load(Ordering::Relaxed)
        };
        let lightmap = Lightmap::new(&loaded, settings, &mut memory, &mut watch);
        reporter.end();
        let lightmap = match lightmap {
            Err(error @ LightmapError::Ended) => {
                let object = || json!({ "interrupted": true, "outputs": [] });
                return Ok(outputs.end_with(object, || error.to_string(), ExitCode::from(3)));
            }
            lightmap => lightmap.map_err(|error| {
                Failure::new(format!("{}: {error}", bake.scene.display())).advice(error.advice())
            })?,
        };
        lightmap.notes.iter().for_each(print_note);
        let limit = Some(memory.limit() + memory.left() - before);
        let attached = lightmap.attachment(bake.quantity());
        let baked =
            bake.bake(&loaded, lightmap.points(), (limit, attached), start.elapsed().as_secs_f64())?;
        baked.unsaved.iter().for_each(|why| outputs.fail(why.clone()));
        let saved = files.save(&mut outputs, (&lightmap, &baked, bake.quantity()), bake.time);
        let text = format!("{saved}{}", bake.text(&baked));
        let object = || {
            let mut object = bake.object(&baked);
            saved.add_to(&mut object);
            object["error_map"] = self.error_map.as_deref().map_or(Value::Null, file_name);
            object
        };
        Ok(outputs.end_with(object, || text, code(&baked)))
    }
}
