//! Grids of light probes by `halflight bake`.

use super::{Bake, check_outputs, code, memory};
use crate::cli::bake_files::ProbeFiles;
use crate::cli::failure::Failure;
use crate::cli::outputs::Outputs;
use crate::cli::values;
use clap::Args;
use halflight::bake::{ProbeGrid, ProbeSettings};
use halflight::load::LoadOptions;
use std::process::ExitCode;

#[derive(Args)]
pub(super) struct ProbeArgs {
    /// Light probes at the centres of so many cells along x, y and z
    #[arg(long, value_name = "NXxNYxNZ", value_parser = values::grid, conflicts_with = "unit")]
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
        let files = ProbeFiles::new(&bake.output)?;
        files.plan(&mut outputs)?;
        bake.parts.plan(&mut outputs)?;
        check_outputs(bake, "--probes", "-o probes.json")?;
        let options = LoadOptions { memory: bake.memory, ..LoadOptions::default() };
        let loaded = bake.load(&outputs, &options)?;
        // Parts have all that their merge may write.
        let cubes = files.has_cubes() || bake.parts.is_part();
        let settings = ProbeSettings { size, bounds: self.bounds, cubes };
        let mut memory = memory(bake, &loaded);
        let before = memory.left();
        let grid = ProbeGrid::new(&loaded, settings, &mut memory).map_err(|why| {
            Failure::new(format!("{}: too many probes: {why}", bake.scene.display()))
                .advice("lower --probes, or raise --memory")
        })?;
        let limit = Some(memory.limit() + memory.left() - before);
        let baked = bake.bake(&loaded, grid.points(), (limit, grid.attachment()), 0.0)?;
        baked.unsaved.iter().for_each(|why| outputs.fail(why.clone()));
        let saved = files.save(&mut outputs, (&grid, &baked));
        let text = format!("{saved}{}", bake.text(&baked));
        let object = || {
            let mut object = bake.object(&baked);
            saved.add_to(&mut object);
            object
        };
        Ok(outputs.end_with(object, || text, code(&baked)))
    }
}
