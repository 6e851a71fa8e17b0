//! Reading and writing whole files. A file is written beside its place and then renamed into it, so that
//! an interrupted write leaves the old one as it was.

use super::{Format, Image, PictureError, decode, encode};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Longest file that is read, in bytes.
const MAX_FILE: u64 = 8 << 30;

/// The picture in a file; the extension says the format. See [`decode`].
///
/// # Errors
/// Names the file and what is wrong with it.
pub fn read(path: &Path) -> Result<Image, PictureError> {
    let format = Format::of(path)?;
    let about = |error: io::Error| PictureError::new(words(&error)).at(path);
    let length = fs::metadata(path).map_err(about)?.len();
    if length > MAX_FILE {
        return Err(PictureError::new(format!("{length} bytes are too many for a picture")).at(path));
    }
    let bytes = fs::read(path).map_err(about)?;
    decode(&bytes, format).map_err(|error| error.at(path))
}

/// Writes a picture; the extension says the format. The file appears whole or not at all.
///
/// # Errors
/// Names the file and why it cannot be written.
pub fn write(path: &Path, image: &Image) -> Result<(), PictureError> {
    replace(path, &encode(image, Format::of(path)?).map_err(|error| error.at(path))?)
}

/// Writes a file, which appears whole or not at all.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> Result<(), PictureError> {
    let about =
        |error: io::Error| PictureError::new(format!("cannot be written: {}", words(&error))).at(path);
    if is_special(path) {
        return OpenOptions::new().write(true).open(path).and_then(|mut f| f.write_all(bytes)).map_err(about);
    }
    let target = place(path);
    let beside = temporary(&target);
    let written = File::create_new(&beside)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| fs::rename(&beside, &target));
    if written.is_err() {
        // Of no use to anybody; if even this fails the first error says why.
        let _ = fs::remove_file(&beside);
    }
    written.map_err(about)
}

/// Finds out, before a long render, whether [`write()`] will find its way: the extension is known, the
/// folder is there and takes files, and the file may be replaced.
///
/// # Errors
/// Names the file and what to do.
pub fn check_writable(path: &Path) -> Result<(), PictureError> {
    Format::of(path)?;
    let refuse = |reason: String| Err(PictureError::new(reason).at(path));
    let target = place(path);
    if target.is_dir() {
        return refuse("cannot be written: it is a folder".into());
    }
    let folder = folder(&target);
    if !folder.is_dir() {
        return refuse(format!("cannot be written: there is no folder {}", folder.display()));
    }
    if target.exists()
        && let Err(error) = OpenOptions::new().append(true).open(&target)
    {
        return refuse(format!("cannot be written: {}", words(&error)));
    }
    if is_special(path) {
        return Ok(());
    }
    let beside = temporary(&target);
    if let Err(error) = File::create_new(&beside) {
        return refuse(format!("cannot be written in {}: {}", folder.display(), words(&error)));
    }
    let _ = fs::remove_file(&beside);
    Ok(())
}

/// Pipes and devices are written in place.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir())
}

/// Where the file lies, links followed: the link stays a link.
fn place(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn temporary(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    folder(path).join(format!(".{name}.{}.part", std::process::id()))
}

/// The error without the number of the operating system.
pub(crate) fn words(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file".into(),
        io::ErrorKind::PermissionDenied => "permission denied".into(),
        io::ErrorKind::StorageFull => "the disk is full".into(),
        _ => error.to_string(),
    }
}
