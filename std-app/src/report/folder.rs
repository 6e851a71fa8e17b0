//! The folder of a report: found usable before a long render, filled after it.

use super::Files;
use crate::save::{Destination, Patience, PictureError, check_destination, io_reason, not_written, replace};
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The files of a report, and marks of those that this program has written.
const FILES: [(&str, &[&str]); 3] = [
    ("index.html", &["<p class=\"brand\">halflight</p>"]),
    ("curve.csv", &["seconds,spp,rays,relmse,", "method,seconds,spp,rays,relmse,"]),
    ("run.json", &["\"version\": \"halflight "]),
];

/// Bytes of a file that are looked at: no report is longer.
const LONGEST: u64 = 1 << 28;

/// The files that a report in `folder` has.
pub fn report_files(folder: &Path) -> [PathBuf; 3] {
    FILES.map(|(name, _)| folder.join(name))
}

/// Checks that [`write_folder`] can write its files, and that files of these names are those of an earlier report.
///
/// # Errors
/// Names the folder or the file and what to do.
pub fn check_folder(folder: &Path) -> Result<(), PictureError> {
    let refuse = |reason: String| PictureError::new(reason).at(folder);
    if folder.exists() && !folder.is_dir() {
        return Err(refuse("cannot hold a report: it is a file, not a folder".into()));
    }
    if !folder.exists() {
        // As of a file: the folder above is there and writable.
        return check_destination(folder).map_err(refuse);
    }
    for (path, (_, marks)) in report_files(folder).iter().zip(FILES) {
        check_destination(path).map_err(|why| PictureError::new(why).at(path))?;
        let is_ours = is_ours(path, marks);
        if !is_ours.map_err(|error| PictureError::new(not_written(&error)).at(path))? {
            let why = "would be overwritten by the report, and is not of one: give the report another folder";
            return Err(PictureError::new(why).at(path));
        }
    }
    Ok(())
}

/// Whether `path` may be replaced by a file of a report.
fn is_ours(path: &Path, marks: &[&str]) -> io::Result<bool> {
    if Destination::of(path)?.is_stream() || !path.exists() {
        return Ok(true);
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(LONGEST).read_to_end(&mut bytes)?;
    let text = String::from_utf8_lossy(&bytes);
    Ok(marks.iter().any(|mark| text.contains(mark)))
}

/// Writes the files of a report, and makes the folder where only it is missing; each file appears whole or not at
/// all. One that cannot be written does not keep the others from it.
///
/// # Errors
/// For each file that is not there, its name and why.
pub fn write_folder(folder: &Path, files: &Files, patience: Patience) -> Result<(), Vec<PictureError>> {
    if !folder.is_dir()
        && let Err(error) = Destination::of(folder).and_then(|destination| fs::create_dir(destination.path()))
    {
        let why = format!("cannot be made: {}", io_reason(&error));
        return Err(vec![PictureError::new(why).at(folder)]);
    }
    let write = |(name, bytes): &(&str, Vec<u8>)| replace(&folder.join(name), bytes, patience).err();
    let failed: Vec<_> = files.iter().filter_map(write).collect();
    if failed.is_empty() { Ok(()) } else { Err(failed) }
}
