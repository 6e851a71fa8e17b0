//! Folder of a report: checked before a long render, written after it.

use super::Files;
use crate::save::{Destination, FileError, Patience, check_destination, replace};
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Files of a report, and marks by which files of earlier reports are recognised.
const FILES: [(&str, &[&str]); 3] = [
    ("index.html", &["<p class=\"brand\">halflight</p>"]),
    ("curve.csv", &["seconds,spp,rays,relmse,", "method,seconds,spp,rays,relmse,"]),
    ("run.json", &["\"version\": \"halflight "]),
];

/// Bytes of a file that are searched for marks; reports are shorter.
const MAX_BYTES: u64 = 1 << 28;

/// Paths of the files of a report in `folder`.
pub fn report_files(folder: &Path) -> [PathBuf; 3] {
    FILES.map(|(name, _)| folder.join(name))
}

/// Checks that [`write_folder`] can write its files and replaces only files of an earlier report.
///
/// # Errors
/// Folder or file that cannot be used, with the reason and advice.
pub fn check_folder(folder: &Path) -> Result<(), FileError> {
    if folder.exists() && !folder.is_dir() {
        return Err(FileError::new("cannot hold a report: it is a file, not a folder").at(folder));
    }
    if !folder.exists() {
        // The parent folder must exist and be writable, as for a file.
        return check_destination(folder);
    }
    for (path, (_, marks)) in report_files(folder).iter().zip(FILES) {
        check_destination(path)?;
        if !is_ours(path, marks).map_err(|error| FileError::io(&error).at(path))? {
            let why = "is not part of a report and would be overwritten: choose another folder";
            return Err(FileError::new(why).at(path));
        }
    }
    Ok(())
}

/// True if a report may replace the file at `path`.
fn is_ours(path: &Path, marks: &[&str]) -> io::Result<bool> {
    if Destination::of(path)?.is_stream() || !path.exists() {
        return Ok(true);
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_BYTES).read_to_end(&mut bytes)?;
    let text = String::from_utf8_lossy(&bytes);
    Ok(marks.iter().any(|mark| text.contains(mark)))
}

/// Writes the files of a report, and creates the folder if its parent exists. Files are whole or absent, and
/// a failure does not affect the other files.
///
/// # Errors
/// Every file that was not written, with the reason.
pub fn write_folder(folder: &Path, files: &Files, patience: Patience) -> Result<(), Vec<FileError>> {
    if !folder.is_dir()
        && let Err(error) = Destination::of(folder).and_then(|destination| fs::create_dir(destination.path()))
    {
        let why = format!("cannot be created: {}", FileError::io(&error));
        return Err(vec![FileError::new(why).at(folder)]);
    }
    let write = |(name, bytes): &(&str, Vec<u8>)| replace(&folder.join(name), bytes, patience).err();
    let failed: Vec<_> = files.iter().filter_map(write).collect();
    if failed.is_empty() { Ok(()) } else { Err(failed) }
}
