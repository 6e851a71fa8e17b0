//! Results of a command: lines of text as they come, or one JSON object at the end.

use serde_json::Value;
use std::io::{self, Write};

/// Writer of results.
pub(crate) struct Output<'o> {
    json: bool,
    to: &'o mut dyn Write,
    written: io::Result<()>,
}

impl<'o> Output<'o> {
    pub(crate) fn new(json: bool, to: &'o mut dyn Write) -> Self {
        Self { json, to, written: Ok(()) }
    }

    /// Writes a line, unless the result is an object.
    pub(crate) fn line(&mut self, text: impl AsRef<str>) {
        if !self.json {
            self.write(text.as_ref());
        }
    }

    /// Writes the object, unless the result is text.
    pub(crate) fn object(&mut self, object: &Value) {
        if self.json {
            self.write(&object.to_string());
        }
    }

    /// The first failure.
    pub(crate) fn written(self) -> io::Result<()> {
        self.written
    }

    fn write(&mut self, text: &str) {
        if self.written.is_ok() {
            self.written = writeln!(self.to, "{text}").and_then(|()| self.to.flush());
        }
    }
}
