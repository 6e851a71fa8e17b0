//! `halflight completions` and `halflight man`: completions of shells, and manual pages.

use super::failure::Failure;
use super::stdio::check_output;
use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man as Page;
use halflight::save::check_destination;
use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

/// Print the completions of a shell
///
/// For example `halflight completions bash > ~/.local/share/bash-completion/completions/halflight`.
#[derive(Args)]
pub(super) struct Completions {
    /// Shell
    shell: Shell,
}

impl Completions {
    pub(super) fn run(&self, program: &mut Command) -> Result<ExitCode, Failure> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, program, "halflight", &mut text);
        check_output(stdout().write_all(&text).and_then(|()| stdout().flush()))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Print the manual page, or write those of all commands into a folder
#[derive(Args)]
pub(super) struct Man {
    /// Existing folder for halflight.1, halflight-render.1 and others
    folder: Option<PathBuf>,
}

impl Man {
    pub(super) fn run(&self, program: Command) -> Result<ExitCode, Failure> {
        match &self.folder {
            None => {
                let mut text = Vec::new();
                Page::new(program).render(&mut text)?;
                check_output(stdout().write_all(&text).and_then(|()| stdout().flush()))?;
            }
            Some(folder) => {
                check_destination(&folder.join("halflight.1"))?;
                clap_mangen::generate_to(program, folder)
                    .map_err(|error| Failure::new(format!("{}: {error}", folder.display())))?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}
