//! What a load can end with instead of a scene: where the input is wrong, and what to do about it.

use core::fmt;
use std::path::{Path, PathBuf};

/// A file that cannot be loaded. Displays as `FILE:LINE: what is wrong` and a line of help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadError {
    /// The file.
    pub file: PathBuf,
    /// Line, counted from 1; 0 where the problem has no line.
    pub line: u32,
    /// Column in characters, counted from 1; 0 where it is not known.
    pub column: u32,
    /// What is wrong, one sentence without a full stop.
    pub problem: String,
    /// What can be done about it; may be empty.
    pub help: String,
}

impl LoadError {
    /// An error about a whole file.
    pub fn of_file(file: &Path, problem: impl Into<String>, help: impl Into<String>) -> Self {
        Self::at(file, 0, problem, help)
    }

    /// An error at a line of a file.
    pub fn at(file: &Path, line: u32, problem: impl Into<String>, help: impl Into<String>) -> Self {
        Self { file: file.into(), line, column: 0, problem: problem.into(), help: help.into() }
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if self.line > 0 {
            write!(f, ":{}", self.line)?;
        }
        if self.column > 0 {
            write!(f, ":{}", self.column)?;
        }
        write!(f, ": {}", self.problem)?;
        if !self.help.is_empty() {
            write!(f, "\n  help: {}", self.help)?;
        }
        Ok(())
    }
}

impl core::error::Error for LoadError {}
