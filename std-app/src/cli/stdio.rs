//! Standard output and standard error without the panics of `println!`. A failed write of results is a
//! failure, unless the reader has closed the pipe. A failed write of notes is ignored.

use super::failure::Failure;
use core::fmt::Display;
use halflight::save::Identity;
use std::io::{self, Write, stderr, stdout};

/// Prints a result on standard output.
///
/// # Errors
/// Results that were not written, except to a closed pipe.
pub(super) fn print_result(text: &str) -> Result<(), Failure> {
    check_output(writeln!(stdout(), "{text}").and_then(|()| stdout().flush()))
}

/// Failure of a write to standard output, except to a closed pipe.
pub(super) fn check_output(written: io::Result<()>) -> Result<(), Failure> {
    match written {
        Err(error) if !is_closed(&error) => {
            Err(Failure::new(format!("the results could not be written to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// True if the pipe or the terminal is closed.
fn is_closed(error: &io::Error) -> bool {
    /// EIO: a closed terminal, or a file on a broken disk.
    const INPUT_OUTPUT: i32 = 5;
    let is_file = || Identity::of_open(stdout()).is_some();
    error.kind() == io::ErrorKind::BrokenPipe || (error.raw_os_error() == Some(INPUT_OUTPUT) && !is_file())
}

/// Prints a line on standard error.
pub(super) fn print_message(text: impl Display) {
    // A single write keeps lines of several threads whole.
    let _ = stderr().write_all(format!("{text}\n").as_bytes());
}

/// Prints a note on standard error.
pub(super) fn print_note(text: impl Display) {
    print_message(format_args!("note: {text}"));
}
