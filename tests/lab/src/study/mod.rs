//! Studies: experiments on parts of a method.

mod irradiance;
mod points;
mod radiance;
mod reconstruction;
mod threads;

use crate::Result;
use crate::output::Output;
use clap::{Args, Subcommand};

/// Compare variants of a part of a method
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct Study {
    #[command(subcommand)]
    subject: Subject,
}

#[derive(Subcommand)]
enum Subject {
    Irradiance(Box<irradiance::Irradiance>),
    Points(points::Points),
    Radiance(radiance::Radiance),
    Reconstruction(reconstruction::Reconstruction),
}

impl Study {
    pub(crate) fn run(&self, output: &mut Output) -> Result<()> {
        match &self.subject {
            Subject::Irradiance(study) => study.run(output),
            Subject::Points(study) => study.run(output),
            Subject::Radiance(study) => study.run(output),
            Subject::Reconstruction(study) => study.run(output),
        }
    }
}
