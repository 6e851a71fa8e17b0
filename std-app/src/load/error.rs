//! The error of a load: file, line, problem and help.

use core::fmt;
use std::path::{Path, PathBuf};

/// A file that cannot be loaded. Displays as `FILE:LINE:COLUMN: problem` and a line of help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadError {
    /// The file.
    pub file: PathBuf,
    /// Line, from 1; 0: none.
    pub line: u32,
    /// Column in characters, from 1; 0: unknown.
    pub column: u32,
    /// One sentence without a full stop.
    pub problem: String,
    /// Advice to the user; may be empty.
    pub help: String,
}

impl LoadError {
    /// An error of a whole file.
    pub fn of_file(file: &Path, problem: impl Into<String>, help: impl Into<String>) -> Self {
        Self::at(file, 0, problem, help)
    }

    /// An error at a line of a file.
    pub fn at(file: &Path, line: u32, problem: impl Into<String>, help: impl Into<String>) -> Self {
        Self { file: file.into(), line, column: 0, problem: problem.into(), help: help.into() }
    }
}

/// A place in a text file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextPlace {
    /// The file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
}

impl TextPlace {
    /// An error at this place.
    pub fn error(&self, problem: impl Into<String>, help: impl Into<String>) -> LoadError {
        LoadError { column: self.column, ..LoadError::at(&self.file, self.line, problem, help) }
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
