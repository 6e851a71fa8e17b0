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
    #[arg(long, value_name = "FILE", group = "kept", help_heading = "Parts")]
    checkpoint: Option<PathBuf>,
    /// Interval between checkpoints; the last one is written at the end [default: 60s]
    #[arg(long, value_name = "TIME", value_parser = values::duration, requires = "kept",
        help_heading = "Parts")]
    checkpoint_every: Option<f64>,
    /// Continue the file of a checkpoint, with the same flags except --spp, --time and --error
    #[arg(long, value_name = "FILE", help_heading = "Parts")]
    resume: Option<PathBuf>,
    /// Keep the samples in a file as --checkpoint does, and continue it as --resume does if it exists
    #[arg(
        long = "continue",
        value_name = "FILE",
        group = "kept",
        conflicts_with = "resume",
        help_heading = "Parts"
    )]
    continued: Option<PathBuf>,
}

impl CheckpointArgs {
    /// Plans the file.
    pub(super) fn plan(&self, outputs: &mut Outputs) -> Result<(), Failure> {
        self.written().map_or(Ok(()), |file| outputs.plan(Role::Checkpoint, file))
    }

    /// Protects the file to be continued.
    pub(super) fn protect(&self, outputs: &Outputs) -> Result<(), Failure> {
        self.resume().iter().try_for_each(|file| outputs.protect_except(file, Role::Checkpoint))
    }

    fn written(&self) -> Option<&PathBuf> {
        self.checkpoint.as_ref().or(self.continued.as_ref())
    }

    /// The file to write.
    pub(super) fn checkpoint(&self) -> Option<Checkpoint> {
        let every = self.checkpoint_every.unwrap_or(Checkpoint::EVERY);
        self.written().cloned().map(|path| Checkpoint { path, every })
    }

    /// The file to continue.
    pub(super) fn resume(&self) -> Option<PathBuf> {
        self.resume.clone().or_else(|| self.continued.clone().filter(|file| file.exists()))
    }
}
