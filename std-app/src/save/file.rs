//! Reading of picture files, and atomic writing of all files: a file is written under a temporary name in its
//! folder and then renamed, so that either the old or the new file exists, complete, whenever the program
//! ends.

use super::destination::{Destination, folder};
use super::partial_file::PartialFile;
use super::stream::{self, Patience};
use super::{FileError, Format, Image, encode};
use crate::memory::{self, Budget};
use crate::picture::{self, Kind};
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Bytes of the write buffer.
const BUFFER: usize = 1 << 20;

/// Reads a picture in at most `most` bytes of memory. Also returns one sentence for each repair, with the
/// file.
///
/// # Errors
/// An unreadable picture; the message names the file.
pub fn read_within(path: &Path, most: usize) -> Result<(Image, Vec<String>), FileError> {
    let bytes = memory::read_file(path, most).map_err(|error| FileError::io(&error).at(path))?;
    let about = |error: FileError| error.at(path);
    let info = picture::read_info(&bytes, path).map_err(about)?;
    // Integers become floats, in memory of their own.
    let image = match info.kind {
        Kind::Exr | Kind::Hdr | Kind::Pfm => 0,
        _ => info.width as usize * info.height as usize * size_of::<[f32; 3]>(),
    };
    let most = most.saturating_sub(bytes.len()).saturating_sub(image);
    let mut picture = picture::decode(&bytes, path, most).map_err(about)?;
    let notes = picture.notes.drain(..).map(|note| format!("{}: {note}", path.display())).collect();
    Ok((Image::from(picture), notes))
}

/// As [`read_within`], in the default memory ([`Budget::new`]), without repairs.
///
/// # Errors
/// An unreadable picture; the message names the file.
pub fn read(path: &Path) -> Result<Image, FileError> {
    read_within(path, Budget::new(None).limit()).map(|(image, _)| image)
}

/// Writes a picture in the format of its extension. A file is replaced atomically; a pipe or device is
/// written in place, after a wait of 2.5 s for its reader.
///
/// # Errors
/// A file that cannot be written; the message names it.
pub fn write(path: &Path, image: &Image) -> Result<(), FileError> {
    write_with(path, image, Patience::least())
}

/// As [`write()`], with another wait for the reader of a pipe.
///
/// # Errors
/// A file that cannot be written; the message names it.
pub fn write_with(path: &Path, image: &Image, patience: Patience) -> Result<(), FileError> {
    let bytes = encode(image, Format::of(path)?).map_err(|error| error.at(path))?;
    replace(path, &bytes, patience)
}

/// Writes `bytes` to a file atomically.
pub(crate) fn replace(path: &Path, bytes: &[u8], patience: Patience) -> Result<(), FileError> {
    replace_with(path, patience, |file| file.write_all(bytes))
}

/// Writes the output of `put` to a file atomically.
pub(crate) fn replace_with(
    path: &Path,
    patience: Patience,
    put: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), FileError> {
    let written = || {
        let destination = Destination::of(path)?;
        if destination.is_stream() {
            let mut bytes = Vec::new();
            put(&mut bytes)?;
            return stream::write(&destination, bytes, patience);
        }
        let (part, file) = PartialFile::create(destination.path())?;
        fill(file, put)?;
        part.rename(destination.path())
    };
    written().map_err(|error| FileError::not_written(&error).at(path))
}

fn fill(file: File, put: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut file = BufWriter::with_capacity(BUFFER, file);
    put(&mut file)?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

/// Checks before a long render that [`write()`] can succeed: the extension is known, the folder exists and is
/// writable, and the file may be replaced.
///
/// # Errors
/// A file that cannot be written; the message names it and the remedy.
pub fn check_writable(path: &Path) -> Result<(), FileError> {
    Format::of(path)?;
    check_destination(path)
}

/// As [`check_writable`], for files other than pictures.
///
/// # Errors
/// A file that cannot be written; the message names it and the remedy.
pub fn check_destination(path: &Path) -> Result<(), FileError> {
    let refuse = |why: String| Err(FileError::new(format!("cannot be written{why}")).at(path));
    let destination = Destination::of(path).map_err(|error| FileError::not_written(&error).at(path))?;
    if destination.is_folder() {
        return refuse(": it is a folder".into());
    }
    if destination.is_stream() {
        return Ok(());
    }
    let (target, folder) = (destination.path(), folder(destination.path()));
    if target.file_name().is_none() || !folder.is_dir() {
        return refuse(format!(": there is no folder {}", folder.display()));
    }
    if target.exists()
        && let Err(error) = OpenOptions::new().append(true).open(target)
    {
        return Err(FileError::not_written(&error).at(path));
    }
    match PartialFile::create(target) {
        Ok(_) => Ok(()),
        Err(error) => refuse(format!(" in {}: {}", folder.display(), FileError::io(&error))),
    }
}
