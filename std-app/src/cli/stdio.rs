//! Standard output and standard error without the panics of `println!`. A failed write of results is a
//! failure, unless the reader has closed the pipe. A failed write of notes is ignored. Names in files and of
//! files may contain control characters, which would command the terminal: they are escaped here.

use super::failure::Failure;
use core::fmt::Display;
use core::sync::atomic::{AtomicU8, Ordering};
use halflight::save::Identity;
use std::borrow::Cow;
use std::io::{self, Write, stderr, stdout};

/// Prints a result on standard output.
///
/// # Errors
/// Results that were not written, except to a closed pipe.
pub(super) fn print_result(text: &str) -> Result<(), Failure> {
    check_output(writeln!(stdout(), "{}", escaped(text)).and_then(|()| stdout().flush()))
}

/// `text` with control characters other than line ends as `\u001b`, which JSON has too.
pub(super) fn escaped(text: &str) -> Cow<'_, str> {
    if !text.contains(is_control) {
        return text.into();
    }
    let escape = |c: char| match is_control(c) {
        true => format!("\\u{:04x}", u32::from(c)),
        false => c.to_string(),
    };
    text.chars().map(escape).collect()
}

/// True for control characters other than line ends, and for those that change the direction of text.
fn is_control(c: char) -> bool {
    (c.is_control() && c != '\n') || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
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

/// Form of messages on standard error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Messages {
    /// Lines for people.
    Text,
    /// An object a line.
    Json,
    /// Errors alone.
    Quiet,
}

/// Form of the messages of this program: 0 to 2, as [`Messages`].
static MESSAGES: AtomicU8 = AtomicU8::new(Messages::Text as u8);

/// Chooses the form of messages.
pub(super) fn set_messages(messages: Messages) {
    MESSAGES.store(messages as u8, Ordering::Relaxed);
}

fn messages_are(messages: Messages) -> bool {
    MESSAGES.load(Ordering::Relaxed) == messages as u8
}

/// True if neither notes nor progress nor summaries are printed.
pub(super) fn is_quiet() -> bool {
    messages_are(Messages::Quiet)
}

/// True if messages are objects.
pub(super) fn is_json() -> bool {
    messages_are(Messages::Json)
}

/// Prints an object of the kind `event` on standard error.
pub(super) fn print_event(event: &str, mut object: serde_json::Value) {
    object["event"] = event.into();
    let _ = stderr().write_all(format!("{object}\n").as_bytes());
}

/// Prints a line on standard error.
pub(super) fn print_message(text: impl Display) {
    if is_json() {
        return print_event("message", serde_json::json!({ "text": text.to_string() }));
    }
    // A single write keeps lines of several threads whole.
    let _ = stderr().write_all(format!("{}\n", escaped(&text.to_string())).as_bytes());
}

/// Prints a note on standard error.
pub(super) fn print_note(text: impl Display) {
    match (is_quiet(), is_json()) {
        (true, _) => {}
        (_, true) => print_event("note", serde_json::json!({ "text": text.to_string() })),
        _ => print_message(format_args!("note: {text}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped_and_text_is_not() {
        for (text, expected) in [
            ("a\u{1b}]0;b\u{7}c\nd", "a\\u001b]0;b\\u0007c\nd"),
            ("\r\t\u{7f}\u{9b}2J\u{202e}", "\\u000d\\u0009\\u007f\\u009b2J\\u202e"),
            ("größe 木 12\u{202f}345 C:\\a", "größe 木 12\u{202f}345 C:\\a"),
        ] {
            assert_eq!(escaped(text), expected);
        }
        let name = "\u{9b}\u{7f}";
        let object = serde_json::json!({ "name": name });
        assert_eq!(serde_json::from_str::<serde_json::Value>(&escaped(&object.to_string())).unwrap(), object);
    }
}
