//! Lightmaps by `halflight bake`.

use super::{Bake, check_outputs, code, memory};
use crate::cli::failure::Failure;
use crate::cli::outputs::{Outputs, Role};
use crate::cli::{print_note, values};
use clap::Args;
use halflight::bake::{Lightmap, LightmapSettings, Texel, check_format};
use halflight::load::LoadOptions;
use halflight::report::file_name;
use halflight::save::{FileError, Format};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Rings of texels around charts without `--pad`: enough for bilinear fetches of two mip levels.
const PADDING: u32 = 4;

/// Subjects of other runs. clap drops a requirement that conflicts with another flag.
const OTHERS: [&str; 6] = ["points", "vertices", "probes", "checkpoint", "resume", "shard"];

#[derive(Args)]
pub(super) struct LightmapArgs {
    /// Lightmap of a mesh, by the name of its file, of an object, by its `o` or `g` or node, of a material,
    /// or of `all`, in the texture coordinates of the files
    #[arg(long, value_name = "NAME", requires = "size", conflicts_with_all = OTHERS)]
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
    #[arg(long, conflicts_with_all = OTHERS)]
    directional: bool,
}

impl LightmapArgs {
    /// The run of a lightmap; `None` for other subjects.
    pub(super) fn run(&self, bake: &Bake) -> Option<Result<ExitCode, Failure>> {
        Some(self.run_lightmap(bake, (self.lightmap.as_ref()?, self.size?)))
    }

    fn run_lightmap(&self, bake: &Bake, (subject, size): (&str, [u32; 2])) -> Result<ExitCode, Failure> {
        let mut outputs = Outputs::new(bake.json);
        let maps = pictures(&bake.output, self.directional)?;
        let error_map = pictures(self.error_map.as_slice(), false)?;
        maps.iter().try_for_each(|(path, _)| outputs.plan(Role::Table, path))?;
        error_map.iter().try_for_each(|(path, _)| outputs.plan(Role::ErrorMap, path))?;
        check_outputs(bake, "--lightmap", "-o map.exr")?;
        let options = LoadOptions { memory: bake.memory, keeps_texcoords: true, ..LoadOptions::default() };
        let loaded = bake.load(&outputs, &options)?;
        let settings = LightmapSettings {
            subject: (subject != "all").then(|| subject.to_owned()),
            size,
            points: self.supersample.unwrap_or(1),
            padding: self.pad.unwrap_or(PADDING),
            directional: self.directional,
        };
        let mut memory = memory(bake, &loaded);
        let before = memory.left();
        let lightmap = Lightmap::new(&loaded, settings, &mut memory).map_err(|error| {
            Failure::new(format!("{}: {error}", bake.scene.display())).advice(error.advice())
        })?;
        lightmap.notes.iter().for_each(print_note);
        let baked = bake.bake(
            &loaded,
            lightmap.points(),
            (Some(memory.limit() + memory.left() - before), Vec::new()),
        )?;
        let map = lightmap.map(&baked, bake.quantity());
        maps.iter().for_each(|(path, format)| save(&mut outputs, path, map.encode(*format)));
        error_map.iter().for_each(|(path, format)| save(&mut outputs, path, map.encode_error(*format)));
        let (computed, filled) = (map.count(Texel::Computed), lightmap.filled(&map));
        let padded = map.count(Texel::Filled) - filled;
        let charts = lightmap.charts();
        let object = || {
            let mut object = bake.object(&baked);
            object["charts"] = charts.into();
            object["texels"] = json!({ "computed": computed, "filled": filled, "padded": padded });
            object["error_map"] = self.error_map.as_deref().map_or(Value::Null, file_name);
            object
        };
        let texels = format!("{charts} charts, {computed} texels computed and {filled} filled");
        Ok(outputs.end_with(object, || format!("{texels}; {}", bake.text(&baked)), code(&baked)))
    }
}

/// Files and formats of maps.
fn pictures(paths: &[PathBuf], is_signed: bool) -> Result<Vec<(PathBuf, Format)>, Failure> {
    let format = |path: &PathBuf| {
        let format = Format::of(path)?;
        check_format(format, is_signed)
            .map_err(|error| Failure::new(format!("{}: {error}", path.display())))?;
        Ok((path.clone(), format))
    };
    paths.iter().map(format).collect()
}

fn save(outputs: &mut Outputs, path: &Path, bytes: Result<Vec<u8>, FileError>) {
    match bytes {
        Ok(bytes) => outputs.save_table(path, |out| out.write_all(&bytes)),
        Err(error) => outputs.fail(error),
    }
}
