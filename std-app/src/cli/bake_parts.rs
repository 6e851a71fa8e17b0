//! Flags of bakes in parts: checkpoints, shards.

use super::checkpoint_args::CheckpointArgs;
use super::failure::Failure;
use super::outputs::Outputs;
use super::values;
use clap::Args;
use halflight::bake::BakeSettings;
use halflight_core::method::Shard;

#[derive(Args)]
pub(super) struct BakeParts {
    #[command(flatten)]
    checkpoint: CheckpointArgs,
    /// Estimate every Nth tile of 256 near points from the Ith on, into the file of --checkpoint; needs --spp
    #[arg(long, value_name = "I/N", value_parser = values::shard, requires = "kept", requires = "spp",
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
        self.checkpoint.plan(outputs)?;
        self.checkpoint.protect(outputs)
    }

    /// `settings` with these parts, whose file has `attached` bytes.
    pub(super) fn add_to(&self, settings: BakeSettings, attached: Vec<u8>) -> BakeSettings {
        let checkpoint = self.checkpoint.checkpoint();
        BakeSettings {
            shard: self.shard.unwrap_or(Shard::WHOLE),
            attached: if checkpoint.is_some() { attached } else { Vec::new() },
            checkpoint,
            resume: self.checkpoint.resume(),
            ..settings
        }
    }
}
