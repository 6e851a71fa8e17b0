//! Flags of checkpoints: a file of the samples, and its continuation.

use super::failure::Failure;
use super::outputs::{Outputs, Role};
use super::values;
use clap::Args;
use halflight::render::Checkpoint;
use std::path::PathBuf;

#[derive(Args)]
pub(super) struct CheckpointArgs {
    /// Keep the samples in a file during the work, for --resume and `halflight merge`
    #[arg(long, value_name = "FILE", help_heading = "Parts")]
    checkpoint: Option<PathBuf>,
    /// Interval between checkpoints; the last one is written at the end [default: 60s]
    #[arg(long, value_name = "TIME", value_parser = values::duration, requires = "checkpoint",
        help_heading = "Parts")]
    checkpoint_every: Option<f64>,
    /// Continue the file of a checkpoint, with the same flags except --spp, --time and --error
    #[arg(long, value_name = "FILE", help_heading = "Parts")]
    resume: Option<PathBuf>,
}

impl CheckpointArgs {
    /// Plans the file.
    pub(super) fn plan(&self, outputs: &mut Outputs) -> Result<(), Failure> {
        self.checkpoint.iter().try_for_each(|file| outputs.plan(Role::Checkpoint, file))
    }

    /// Protects the file to be continued.
    pub(super) fn protect(&self, outputs: &Outputs) -> Result<(), Failure> {
        self.resume.iter().try_for_each(|file| outputs.protect_except(file, Role::Checkpoint))
    }

    /// The file to write.
    pub(super) fn checkpoint(&self) -> Option<Checkpoint> {
        let every = self.checkpoint_every.unwrap_or(Checkpoint::EVERY);
        self.checkpoint.clone().map(|path| Checkpoint { path, every })
    }

    /// The file to continue.
    pub(super) fn resume(&self) -> Option<PathBuf> {
        self.resume.clone()
    }
}
