//! Flags of bakes in parts: checkpoints, shards.

use super::failure::Failure;
use super::outputs::{Outputs, Role};
use super::values;
use clap::Args;
use halflight::bake::BakeSettings;
use halflight::render::Checkpoint;
use halflight_core::method::Shard;
use std::path::PathBuf;

#[derive(Args)]
pub(super) struct BakeParts {
    /// Keep the bake in a file during the work, for --resume and `halflight merge`
    #[arg(long, value_name = "FILE", help_heading = "Parts")]
    checkpoint: Option<PathBuf>,
    /// Interval between checkpoints; the last one is written at the end [default: 60s]
    #[arg(long, value_name = "TIME", value_parser = values::duration, requires = "checkpoint",
        help_heading = "Parts")]
    checkpoint_every: Option<f64>,
    /// Continue the bake of a checkpoint, with the same flags except --spp, --time and --error
    #[arg(long, value_name = "FILE", help_heading = "Parts")]
    resume: Option<PathBuf>,
    /// Estimate every Nth tile of 256 near points from the Ith on, into the file of --checkpoint; needs --spp
    #[arg(long, value_name = "I/N", value_parser = values::shard, requires = "checkpoint", requires = "spp",
        conflicts_with_all = ["time", "error"], help_heading = "Parts")]
    shard: Option<Shard>,
}

impl BakeParts {
    /// True if a part of the points is estimated, whose tables would have points without samples.
    pub(super) fn is_part(&self) -> bool {
        self.shard.is_some_and(|shard| shard != Shard::WHOLE)
    }

    /// Plans the file, and protects the one to be resumed.
    pub(super) fn plan(&self, outputs: &mut Outputs) -> Result<(), Failure> {
        self.checkpoint.iter().try_for_each(|file| outputs.plan(Role::Checkpoint, file))?;
        self.resume.iter().try_for_each(|file| outputs.protect_except(file, Role::Checkpoint))
    }

    /// `settings` with these parts, whose file has `attached` bytes.
    pub(super) fn add_to(&self, settings: BakeSettings, attached: Vec<u8>) -> BakeSettings {
        let every = self.checkpoint_every.unwrap_or(Checkpoint::EVERY);
        BakeSettings {
            shard: self.shard.unwrap_or(Shard::WHOLE),
            attached: if self.checkpoint.is_some() { attached } else { Vec::new() },
            checkpoint: self.checkpoint.clone().map(|path| Checkpoint { path, every }),
            resume: self.resume.clone(),
            ..settings
        }
    }
}
