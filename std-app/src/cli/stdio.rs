//! Standard output and standard error. The library's own macros panic where a write fails; here it is an answer: of
//! results a failure, unless their reader has had enough, and of notes nothing, for they are advice.

use super::failure::Failure;
use core::fmt::Display;
use halflight::save::Identity;
use std::io::{self, Write, stderr, stdout};

/// Prints a result.
///
/// # Errors
/// Results that are lost. A reader that is gone has what it wanted.
pub(super) fn say(text: &str) -> Result<(), Failure> {
    heard(writeln!(stdout(), "{text}").and_then(|()| stdout().flush()))
}

/// The outcome of a write to standard output.
pub(super) fn heard(written: io::Result<()>) -> Result<(), Failure> {
    match written {
        Err(error) if !is_gone(&error) => {
            let why = format!("the results could not be written to standard output: {error}");
            Err(Failure::new(why))
        }
        _ => Ok(()),
    }
}

/// Whether nobody reads any more: the pipe or the terminal is closed.
fn is_gone(error: &io::Error) -> bool {
    /// EIO: a closed terminal, or a file on a broken disk.
    const INPUT_OUTPUT: i32 = 5;
    let is_file = || Identity::of_open(stdout()).is_some();
    error.kind() == io::ErrorKind::BrokenPipe || (error.raw_os_error() == Some(INPUT_OUTPUT) && !is_file())
}

/// Prints a line for a person, on standard error.
pub(super) fn tell(text: impl Display) {
    // One write, so that lines of several threads stay whole; nobody is listening where it fails.
    let _ = stderr().write_all(format!("{text}\n").as_bytes());
}

/// Prints what a person should know.
pub(super) fn warn(text: impl Display) {
    tell(format_args!("note: {text}"));
}
