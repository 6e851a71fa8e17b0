//! The files that a command writes. Before anything is done they are found writable, and told apart as files, not as
//! names, from each other and from all that the command reads. In the end each is written, whatever becomes of the
//! others; then all that failed is said, and the exit code is 2.

use super::failure::Failure;
use super::interrupt::INTERRUPT;
use super::stdio::{say, tell};
use halflight::drive;
use halflight::report::{self, Files};
use halflight::save::{self, Destination, Identity, Image, Patience};
use std::io::{stderr, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// The purpose of an output, with the flag that names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// A picture.
    Picture,
    /// A picture that no flag has named.
    Default,
    /// A film that grows.
    Checkpoint,
    /// Irradiance caches.
    Cache,
    /// A file of a report.
    Report,
    /// Standard output or standard error.
    Standard,
}

impl Role {
    const fn flag(self) -> &'static str {
        match self {
            Role::Picture => "-o",
            Role::Default => "the picture, without -o",
            Role::Checkpoint => "--checkpoint",
            Role::Cache => "--save-cache",
            Role::Report => "--report",
            Role::Standard => "where results and notes go",
        }
    }

    const fn advice(self) -> &'static str {
        match self {
            Role::Default => "say where the picture goes, as in -o picture.png",
            Role::Report => "give the report another folder",
            _ => "give it another name",
        }
    }
}

/// A file that is going to be written.
struct Output {
    role: Role,
    path: PathBuf,
    identity: Identity,
}

/// The files of a command.
pub(super) struct Outputs {
    since: Instant,
    planned: Vec<Output>,
    is_json: bool,
    /// Whether a file is standard output, so that the text for a person is not.
    has_stdout: bool,
    failed: Vec<Failure>,
}

impl Outputs {
    /// None yet, of a command that prints text or, where it `is_json`, an object.
    pub(super) fn new(is_json: bool) -> Self {
        // `> picture.png` makes a file of them that another one must not replace.
        let standard = [
            (Identity::of_open(stdout()), "standard output"),
            (Identity::of_open(stderr()), "standard error"),
        ];
        let planned = standard.into_iter().filter_map(|(identity, name)| {
            Some(Output { role: Role::Standard, path: name.into(), identity: identity? })
        });
        Self {
            since: Instant::now(),
            planned: planned.collect(),
            is_json,
            has_stdout: false,
            failed: Vec::new(),
        }
    }

    /// One more, of which it is found out whether it can be written.
    pub(super) fn plan(&mut self, role: Role, path: &Path) -> Result<(), Failure> {
        match role {
            Role::Picture | Role::Default => save::check_writable(path)?,
            Role::Checkpoint | Role::Cache => drive::check_writable(path)?,
            Role::Report | Role::Standard => {}
        }
        if Destination::of(path).is_ok_and(|destination| destination.is_stdout()) {
            if self.is_json {
                let what =
                    format!("{} ({}) and --json both go to standard output", path.display(), role.flag());
                return Err(Failure::new(what).advice("send one of them elsewhere"));
            }
            self.has_stdout = true;
            return Ok(());
        }
        let Some(identity) = Identity::of(path) else { return Ok(()) };
        if let Some(other) = self.planned.iter().find(|other| other.identity == identity) {
            return Err(Failure::new(format!(
                "{} ({}) is the same file as {} ({}): one would overwrite the other",
                path.display(),
                role.flag(),
                other.path.display(),
                other.role.flag(),
            ))
            .advice(role.advice()));
        }
        self.planned.push(Output { role, path: path.to_owned(), identity });
        Ok(())
    }

    /// The files of a report in `folder`.
    pub(super) fn plan_report(&mut self, folder: &Path) -> Result<(), Failure> {
        report::check_folder(folder)?;
        report::report_files(folder).iter().try_for_each(|file| self.plan(Role::Report, file))
    }

    /// Refuses to overwrite `path`, which the command reads.
    pub(super) fn spare(&self, path: &Path) -> Result<(), Failure> {
        self.spare_but(path, Role::Standard)
    }

    /// The same, of a file that may be continued by the output of `role`.
    pub(super) fn spare_but(&self, path: &Path, role: Role) -> Result<(), Failure> {
        let Some(identity) = Identity::of(path) else { return Ok(()) };
        let mut written = self.planned.iter().filter(|output| ![role, Role::Standard].contains(&output.role));
        let Some(output) = written.find(|output| output.identity == identity) else { return Ok(()) };
        Err(Failure::new(format!(
            "{} ({}) would overwrite {}, which is read here: it is the same file",
            output.path.display(),
            output.role.flag(),
            path.display(),
        ))
        .advice(output.role.advice()))
    }

    /// How long readers of pipes are waited for.
    fn patience(&self) -> Patience<'static> {
        Patience { since: self.since, interrupt: &INTERRUPT }
    }

    /// Writes a picture; whether it is there.
    pub(super) fn save(&mut self, path: &Path, image: &Image) -> bool {
        let saved = save::write_with(path, image, self.patience());
        saved.map_err(|error| self.fail(error)).is_ok()
    }

    /// Writes a picture to all of `paths`, to files before it waits for readers of pipes; where it is.
    pub(super) fn save_to<'p>(&mut self, paths: &'p [PathBuf], image: &Image) -> Vec<&'p PathBuf> {
        let is_stream =
            |path: &PathBuf| Destination::of(path).is_ok_and(|destination| destination.is_stream());
        let mut order: Vec<usize> = (0..paths.len()).collect();
        order.sort_by_key(|&i| is_stream(&paths[i]));
        order.retain(|&i| self.save(&paths[i], image));
        order.sort_unstable();
        order.into_iter().map(|i| &paths[i]).collect()
    }

    /// Writes a report; whether its page is there.
    pub(super) fn report(&mut self, folder: &Path, files: &Files) -> bool {
        let failed = report::write_folder(folder, files, self.patience());
        failed.map_err(|errors| errors.into_iter().for_each(|error| self.fail(error))).is_ok()
    }

    /// Something could not be written.
    pub(super) fn fail(&mut self, error: impl Into<Failure>) {
        self.failed.push(error.into());
    }

    /// Prints the results, then what failed. `code` is for a command of which nothing did.
    pub(super) fn end(mut self, results: &str, code: ExitCode) -> ExitCode {
        if self.has_stdout {
            tell(results);
        } else if let Err(failure) = say(results) {
            self.failed.push(failure);
        }
        self.failed.iter().for_each(tell);
        if self.failed.is_empty() { code } else { ExitCode::from(2) }
    }
}
