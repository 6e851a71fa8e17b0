//! Failure of a command: one message with the file, the reason and advice.

use core::fmt;

/// Bad input or usage, exit code 2.
#[derive(Debug)]
pub(super) struct Failure {
    reason: String,
    advice: Option<String>,
}

impl Failure {
    pub(super) fn new(reason: impl fmt::Display) -> Self {
        Self { reason: reason.to_string(), advice: None }
    }

    /// The failure with advice for the user.
    pub(super) fn advice(self, advice: impl fmt::Display) -> Self {
        Self { advice: Some(advice.to_string()), ..self }
    }

    /// Reason and advice, which may be empty.
    pub(super) fn into_parts(self) -> (String, String) {
        (self.reason, self.advice.unwrap_or_default())
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error: {}", self.reason)?;
        match &self.advice {
            Some(advice) => write!(f, "\n  help: {advice}"),
            None => Ok(()),
        }
    }
}

impl<E: core::error::Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::new(error)
    }
}
