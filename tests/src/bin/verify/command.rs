//! Child processes: prints each command line, and names it if it fails.

use crate::{Failure, Outcome};
use core::iter;
use core::sync::atomic::{AtomicUsize, Ordering};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;

/// `program arguments…` in `directory`, split at spaces.
pub(crate) fn command(directory: &Path, line: &str) -> Command {
    let mut words = line.split_whitespace();
    let mut command = Command::new(words.next().unwrap_or_default());
    command.args(words).current_dir(directory);
    command
}

/// Cargo (of another toolchain if `line` names one) without the environment that the outer cargo set.
pub(crate) fn fresh_cargo(directory: &Path, line: &str) -> Command {
    let mut command = command(directory, line);
    for (name, _) in std::env::vars_os() {
        let name_text = name.to_string_lossy();
        let package = name_text.starts_with("CARGO_PKG_") || name_text.starts_with("CARGO_MANIFEST_");
        if package || ["CARGO", "RUSTUP_TOOLCHAIN", "LD_LIBRARY_PATH", "RUSTFLAGS"].contains(&&*name_text) {
            command.env_remove(name);
        }
    }
    command
}

/// Runs a command with its output on the terminal.
pub(crate) fn run(command: &mut Command) -> Result<(), Failure> {
    let shown = show(command);
    println!("$ {shown}");
    match command.stdin(Stdio::null()).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Failure::Failed(format!("`{shown}`: {status}"))),
        Err(error) => Err(Failure::Missing(format!("`{shown}` does not start: {error}"))),
    }
}

/// Runs a command with its output on the terminal. The reason of a failure includes the parts of its standard
/// output between a line `first` and one that starts with `last`.
pub(crate) fn run_with_report(command: &mut Command, first: &str, last: &str) -> Result<(), Failure> {
    let shown = show(command);
    println!("$ {shown}");
    let missing = |error| Failure::Missing(format!("`{shown}` does not start: {error}"));
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().map_err(missing)?;
    let (mut report, mut is_inside) = (String::new(), false);
    for line in child.stdout.take().into_iter().flat_map(|out| BufReader::new(out).lines()) {
        let Ok(line) = line else { continue };
        println!("{line}");
        is_inside = (is_inside || line == first) && !line.starts_with(last);
        if is_inside {
            report += &format!("\n    {line}");
        }
    }
    match child.wait().map_err(missing)? {
        status if status.success() => Ok(()),
        status => Err(Failure::Failed(format!("`{shown}`: {status}{report}"))),
    }
}

/// Runs a command and returns its standard output, trimmed.
pub(crate) fn output(command: &mut Command) -> Outcome {
    let shown = show(command);
    match command.stdin(Stdio::null()).stderr(Stdio::inherit()).output() {
        Ok(out) if out.status.success() => Ok(String::from_utf8_lossy(&out.stdout).trim().to_owned()),
        Ok(out) => Err(Failure::Failed(format!("`{shown}`: {}", out.status))),
        Err(error) => Err(Failure::Missing(format!("`{shown}` does not start: {error}"))),
    }
}

/// Results of `check` for all `items`, in their order: two threads take one item after the other.
pub(crate) fn in_pairs<T: Sync, R: Send>(items: &[T], check: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let work = || {
        let numbers = iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed));
        numbers.map_while(|number| Some((number, check(items.get(number)?)))).collect::<Vec<_>>()
    };
    let mut results = thread::scope(|scope| {
        let threads = [scope.spawn(work), scope.spawn(work)];
        threads.into_iter().flat_map(|thread| thread.join().expect("no check panics")).collect::<Vec<_>>()
    });
    results.sort_by_key(|(number, _)| *number);
    results.into_iter().map(|(_, result)| result).collect()
}

/// Whether a program can be started.
pub(crate) fn exists(program: &str) -> bool {
    let quiet = |mut c: Command| c.stdout(Stdio::null()).stderr(Stdio::null()).stdin(Stdio::null()).status();
    let mut version = Command::new(program);
    version.arg("--version");
    quiet(version).is_ok()
}

fn show(command: &Command) -> String {
    let words = core::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}
