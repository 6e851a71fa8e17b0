//! Output files of a command. All are checked before the work starts: that they can be written, and that none
//! is the same file as another output or an input. At the end each is written even if others fail.

use super::failure::Failure;
use super::interrupt::INTERRUPT;
use super::stdio::{is_quiet, print_message, print_result};
use halflight::report::{self, Files};
use halflight::save::{self, Destination, ExrFile, Format, Identity, Image, Patience};
use serde_json::Value;
use std::io::{self, Write, stderr, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Purpose of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Picture of `-o`.
    Picture,
    /// Picture without `-o`.
    Default,
    /// Picture of `--preview`.
    Preview,
    /// Film of `--checkpoint` or `--continue`.
    Checkpoint,
    /// Table of `bake`.
    Table,
    /// Map of `--error-map`.
    ErrorMap,
    /// Irradiance caches of `--save-cache`.
    Cache,
    /// File of a report.
    Report,
    /// Standard output or standard error.
    Standard,
}

impl Role {
    /// Flag or words that name the output in messages.
    const fn label(self) -> &'static str {
        match self {
            Role::Picture | Role::Table => "-o",
            Role::Default => "the picture, without -o",
            Role::Preview => "--preview",
            Role::Checkpoint => "--checkpoint",
            Role::ErrorMap => "--error-map",
            Role::Cache => "--save-cache",
            Role::Report => "--report",
            Role::Standard => "results and notes",
        }
    }

    const fn advice(self) -> &'static str {
        match self {
            Role::Default => "name the picture, as in -o picture.png",
            Role::Report => "choose another folder for the report",
            _ => "choose another name",
        }
    }
}

/// File to be written.
struct Output {
    role: Role,
    path: PathBuf,
    identity: Identity,
}

/// A picture for files of all formats.
pub(super) struct Picture<'i> {
    pub(super) image: &'i Image,
    /// As PNG files show it.
    pub(super) shown: &'i Image,
    /// The OpenEXR file, with layers and attributes.
    pub(super) exr: &'i dyn Fn() -> ExrFile<'i>,
}

/// Output files of a command.
pub(super) struct Outputs {
    start: Instant,
    planned: Vec<Output>,
    is_json: bool,
    /// True if a file is standard output, so that the summary goes to standard error.
    has_stdout: bool,
    failures: Vec<Failure>,
}

impl Outputs {
    /// Outputs of a command that prints text, or an object if `is_json`.
    pub(super) fn new(is_json: bool) -> Self {
        // With `> picture.png` standard output is a file that no output may replace.
        let standard = [
            (Identity::of_open(stdout()), "standard output"),
            (Identity::of_open(stderr()), "standard error"),
        ];
        let planned = standard.into_iter().filter_map(|(identity, name)| {
            Some(Output { role: Role::Standard, path: name.into(), identity: identity? })
        });
        let planned = planned.collect();
        Self { start: Instant::now(), planned, is_json, has_stdout: false, failures: Vec::new() }
    }

    /// Plans an output.
    ///
    /// # Errors
    /// Files that cannot be written or are planned already.
    pub(super) fn plan(&mut self, role: Role, path: &Path) -> Result<(), Failure> {
        match role {
            Role::Picture | Role::Default | Role::Preview => save::check_writable(path)?,
            Role::Checkpoint | Role::Cache | Role::Table | Role::ErrorMap => save::check_destination(path)?,
            Role::Report | Role::Standard => {}
        }
        if Destination::of(path).is_ok_and(|destination| destination.is_stdout()) {
            if self.is_json {
                let (path, label) = (path.display(), role.label());
                return Err(Failure::new(format!("{path} ({label}) and --json both go to standard output"))
                    .advice("send one of them elsewhere"));
            }
            self.has_stdout = true;
            return Ok(());
        }
        let Some(identity) = Identity::of(path) else { return Ok(()) };
        if let Some(other) = self.planned.iter().find(|other| other.identity == identity) {
            return Err(Failure::new(format!(
                "{} ({}) is the same file as {} ({}): one would overwrite the other",
                path.display(),
                role.label(),
                other.path.display(),
                other.role.label(),
            ))
            .advice(role.advice()));
        }
        self.planned.push(Output { role, path: path.to_owned(), identity });
        Ok(())
    }

    /// Plans the files of a report in `folder`.
    pub(super) fn plan_report(&mut self, folder: &Path) -> Result<(), Failure> {
        report::check_folder(folder)?;
        report::report_files(folder).iter().try_for_each(|file| self.plan(Role::Report, file))
    }

    /// Refuses outputs that would overwrite the input `path`.
    pub(super) fn protect(&self, path: &Path) -> Result<(), Failure> {
        self.protect_except(path, Role::Standard)
    }

    /// [`Self::protect`] for an input that the output of `role` may continue.
    pub(super) fn protect_except(&self, path: &Path, role: Role) -> Result<(), Failure> {
        let Some(identity) = Identity::of(path) else { return Ok(()) };
        let mut written = self.planned.iter().filter(|output| ![role, Role::Standard].contains(&output.role));
        let Some(output) = written.find(|output| output.identity == identity) else { return Ok(()) };
        Err(Failure::new(format!(
            "{} ({}) would overwrite the input {}: both are the same file",
            output.path.display(),
            output.role.label(),
            path.display(),
        ))
        .advice(output.role.advice()))
    }

    fn patience(&self) -> Patience<'static> {
        Patience { since: self.start, interrupt: &INTERRUPT }
    }

    /// Writes a picture; returns whether it was written.
    pub(super) fn save(&mut self, path: &Path, image: &Image) -> bool {
        let saved = save::write_with(path, image, self.patience());
        saved.map_err(|error| self.fail(error)).is_ok()
    }

    /// Writes a picture to all of `paths`, PNG files as they are `shown`, to files before pipes, whose
    /// readers may be slow; returns those written.
    pub(super) fn save_to<'p>(&mut self, paths: &'p [PathBuf], picture: &Picture) -> Vec<&'p PathBuf> {
        let is_stream =
            |path: &PathBuf| Destination::of(path).is_ok_and(|destination| destination.is_stream());
        let mut order: Vec<usize> = (0..paths.len()).collect();
        order.sort_by_key(|&i| is_stream(&paths[i]));
        order.retain(|&i| match Format::of(&paths[i]) {
            Ok(Format::Exr) => self.save_exr(&paths[i], (picture.exr)()),
            Ok(Format::Png) => self.save(&paths[i], picture.shown),
            _ => self.save(&paths[i], picture.image),
        });
        order.sort_unstable();
        order.into_iter().map(|i| &paths[i]).collect()
    }

    fn save_exr(&mut self, path: &Path, file: ExrFile) -> bool {
        let saved = save::write_exr(path, file, self.patience());
        saved.map_err(|error| self.fail(error)).is_ok()
    }

    /// Writes a table.
    pub(super) fn save_table(&mut self, path: &Path, put: impl FnOnce(&mut dyn Write) -> io::Result<()>) {
        if let Err(error) = save::write_bytes(path, put, self.patience()) {
            self.fail(error);
        }
    }

    /// Writes a report; returns whether all of it was written.
    pub(super) fn save_report(&mut self, folder: &Path, files: &Files) -> bool {
        let failed = report::write_folder(folder, files, self.patience());
        failed.map_err(|errors| errors.into_iter().for_each(|error| self.fail(error))).is_ok()
    }

    /// Records the failure of an output.
    pub(super) fn fail(&mut self, error: impl Into<Failure>) {
        self.failures.push(error.into());
    }

    /// Prints the object or the summary of a command, neither of which is made in vain, and failures.
    pub(super) fn end_with(
        self,
        object: impl FnOnce() -> Value,
        summary: impl FnOnce() -> String,
        code: ExitCode,
    ) -> ExitCode {
        let results = match self.is_json {
            true => object().to_string(),
            false if is_quiet() => String::new(),
            false => summary(),
        };
        self.end(&results, code)
    }

    /// Prints results and failures. Returns `code`, or 2 after a failure.
    pub(super) fn end(mut self, results: &str, code: ExitCode) -> ExitCode {
        if results.is_empty() {
            // Only failures are printed.
        } else if self.has_stdout {
            print_message(results);
        } else if let Err(failure) = print_result(results) {
            self.failures.push(failure);
        }
        self.failures.iter().for_each(print_message);
        if self.failures.is_empty() { code } else { ExitCode::from(2) }
    }
}
