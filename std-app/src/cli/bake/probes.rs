//! Grids of light probes by `halflight bake`.

use super::{Bake, check_outputs, code, memory};
use crate::cli::failure::Failure;
use crate::cli::outputs::{Outputs, Role};
use crate::cli::values;
use clap::Args;
use halflight::bake::{ProbeFormat, ProbeGrid, ProbeSettings, write_probes};
use halflight::load::LoadOptions;
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Args)]
pub(super) struct ProbeArgs {
    /// Light probes at the centres of so many cells along x, y and z
    #[arg(long, value_name = "NXxNYxNZ", value_parser = values::grid,
          conflicts_with_all = ["points", "vertices", "lightmap", "unit", "checkpoint", "resume", "shard"])]
    probes: Option<[u32; 3]>,
    /// Box of the cells of probes in the coordinates of the files [default: that of the scene]
    #[arg(long = "box", value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = values::bounds,
          allow_hyphen_values = true, conflicts_with_all = ["points", "vertices", "lightmap"])]
    bounds: Option<[[f64; 3]; 2]>,
}

impl ProbeArgs {
    /// The run of a grid of probes; `None` for other subjects.
    pub(super) fn run(&self, bake: &Bake) -> Option<Result<ExitCode, Failure>> {
        self.probes.map(|size| self.run_probes(bake, size))
    }

    fn run_probes(&self, bake: &Bake, size: [u32; 3]) -> Result<ExitCode, Failure> {
        let mut outputs = Outputs::new(bake.json);
        let format = |path: &PathBuf| match ProbeFormat::of(path) {
            Some(format) => Ok((path.clone(), format)),
            None => Err(Failure::new(format!("{}: probes are .json, .csv or .ktx2", path.display()))
                .advice("choose a name with one of these endings")),
        };
        let files = bake.output.iter().map(format).collect::<Result<Vec<_>, Failure>>()?;
        files.iter().try_for_each(|(path, _)| outputs.plan(Role::Table, path))?;
        check_outputs(bake, "--probes", "-o probes.json")?;
        let options = LoadOptions { memory: bake.memory, ..LoadOptions::default() };
        let loaded = bake.load(&outputs, &options)?;
        let cubes = files.iter().any(|(_, format)| *format == ProbeFormat::Ktx2);
        let settings = ProbeSettings { size, bounds: self.bounds, cubes };
        let mut memory = memory(bake, &loaded);
        let before = memory.left();
        let grid = ProbeGrid::new(&loaded, settings, &mut memory).map_err(|why| {
            Failure::new(format!("{}: too many probes: {why}", bake.scene.display()))
                .advice("lower --probes, or raise --memory")
        })?;
        let baked =
            bake.bake(&loaded, grid.points(), (Some(memory.limit() + memory.left() - before), Vec::new()))?;
        let probes = grid.probes(&baked);
        for (path, format) in &files {
            outputs.save_table(path, |out| write_probes(out, *format, &grid, &probes));
        }
        let inside = probes.iter().filter(|probe| !probe.is_valid).count();
        let object = || {
            let mut object = bake.object(&baked);
            object["probes"] = json!({ "count": probes.len(), "inside": inside });
            object
        };
        let text = || format!("{} probes, {inside} inside bodies; {}", probes.len(), bake.text(&baked));
        Ok(outputs.end_with(object, text, code(&baked)))
    }
}
