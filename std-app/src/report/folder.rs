//! The folder of a report: found usable before a long render, filled after it.

use super::Files;
use crate::save::{PictureError, replace, words};
use std::fs;
use std::path::Path;

/// Finds out whether [`write_folder`] will find its way, and makes the folder where only that is missing.
///
/// # Errors
/// Names the folder and what to do.
pub fn check_folder(folder: &Path) -> Result<(), PictureError> {
    let refuse = |reason: String| PictureError::new(reason).at(folder);
    if folder.exists() && !folder.is_dir() {
        return Err(refuse("cannot hold a report: it is a file, not a folder".into()));
    }
    if !folder.is_dir() {
        fs::create_dir(folder).map_err(|error| refuse(format!("cannot be made: {}", words(&error))))?;
    }
    let probe = folder.join(format!(".{}.part", std::process::id()));
    let written = fs::write(&probe, []).and_then(|()| fs::remove_file(&probe));
    written.map_err(|error| refuse(format!("takes no files: {}", words(&error))))
}

/// Writes the files of a report; each appears whole or not at all.
///
/// # Errors
/// Names the file and why it cannot be written.
pub fn write_folder(folder: &Path, files: &Files) -> Result<(), PictureError> {
    files.iter().try_for_each(|(name, bytes)| replace(&folder.join(name), bytes))
}
