//! Reading and writing whole files: the one reader of pictures by name, and the one writer of everything. A file
//! is written beside its place and then renamed into it, so that whenever the program ends the old file or the new
//! one is there, whole.

use super::part::Part;
use super::place::{Place, folder};
use super::stream::{self, Patience};
use super::{Format, Image, PictureError, encode};
use crate::memory::{self, Budget};
use crate::picture::{self, Kind};
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Bytes that are gathered before they are handed to the system.
const BUFFER: usize = 1 << 20;

/// The picture in a file, whose bytes say the format, in no more than `most` bytes of memory; and what had to be
/// repaired, a sentence for each that names the file. See [`Image::from`].
///
/// # Errors
/// Names the file and what is wrong with it.
pub fn read_within(path: &Path, most: usize) -> Result<(Image, Vec<String>), PictureError> {
    let bytes = memory::read_file(path, most).map_err(|error| PictureError::new(words(&error)).at(path))?;
    let about = |error: PictureError| error.at(path);
    let survey = picture::survey(&bytes, path).map_err(about)?;
    // Whole numbers become floats, in memory of their own.
    let image = match survey.kind {
        Kind::Exr | Kind::Hdr | Kind::Pfm => 0,
        _ => survey.width as usize * survey.height as usize * size_of::<[f32; 3]>(),
    };
    let most = most.saturating_sub(bytes.len()).saturating_sub(image);
    let mut picture = picture::decode(&bytes, path, most).map_err(about)?;
    let notes = picture.notes.drain(..).map(|note| format!("{}: {note}", path.display())).collect();
    Ok((Image::from(picture), notes))
}

/// As [`read_within`], in the memory that is the default ([`Budget::new`]), and without a word of repairs.
///
/// # Errors
/// Names the file and what is wrong with it.
pub fn read(path: &Path) -> Result<Image, PictureError> {
    read_within(path, Budget::new(None).limit()).map(|(image, _)| image)
}

/// Writes a picture; the extension says the format. A file appears whole or not at all; a pipe or a device is
/// written in place, and a reader of it is waited for two and a half seconds.
///
/// # Errors
/// Names the file and why it cannot be written.
pub fn write(path: &Path, image: &Image) -> Result<(), PictureError> {
    write_with(path, image, Patience::least())
}

/// The same, with more patience for the reader of a pipe.
///
/// # Errors
/// Names the file and why it cannot be written.
pub fn write_with(path: &Path, image: &Image, patience: Patience) -> Result<(), PictureError> {
    let bytes = encode(image, Format::of(path)?).map_err(|error| error.at(path))?;
    replace(path, &bytes, patience)
}

/// Writes `bytes` to a file, which appears whole or not at all.
pub(crate) fn replace(path: &Path, bytes: &[u8], patience: Patience) -> Result<(), PictureError> {
    replace_with(path, patience, |file| file.write_all(bytes))
        .map_err(|error| PictureError::new(not_written(&error)).at(path))
}

/// Writes what `put` puts into a file, which appears whole or not at all.
pub(crate) fn replace_with(
    path: &Path,
    patience: Patience,
    put: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let place = Place::of(path)?;
    if place.is_stream() {
        let mut bytes = Vec::new();
        put(&mut bytes)?;
        return stream::write(&place, bytes, patience);
    }
    let (part, file) = Part::create(place.path())?;
    fill(file, put)?;
    part.rename(place.path())
}

fn fill(file: File, put: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut file = BufWriter::with_capacity(BUFFER, file);
    put(&mut file)?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

/// Finds out, before a long render, whether [`write()`] will find its way: the extension is known, the
/// folder is there and takes files, and the file may be replaced.
///
/// # Errors
/// Names the file and what to do.
pub fn check_writable(path: &Path) -> Result<(), PictureError> {
    Format::of(path)?;
    check_place(path).map_err(|why| PictureError::new(why).at(path))
}

/// The same of a file that is no picture; why not.
pub(crate) fn check_place(path: &Path) -> Result<(), String> {
    let place = Place::of(path).map_err(|error| not_written(&error))?;
    if place.is_folder() {
        return Err("cannot be written: it is a folder".into());
    }
    if place.is_stream() {
        return Ok(());
    }
    let (target, folder) = (place.path(), folder(place.path()));
    if target.file_name().is_none() || !folder.is_dir() {
        return Err(format!("cannot be written: there is no folder {}", folder.display()));
    }
    if target.exists()
        && let Err(error) = OpenOptions::new().append(true).open(target)
    {
        return Err(not_written(&error));
    }
    let created = Part::create(target);
    created.map(drop).map_err(|error| format!("cannot be written in {}: {}", folder.display(), words(&error)))
}

/// Why a file is not there, or not the new one.
pub(crate) fn not_written(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "cannot be written: its folder is not there any more".into(),
        _ => format!("cannot be written: {}", words(error)),
    }
}

/// The error without the number of the operating system.
pub(crate) fn words(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file".into(),
        io::ErrorKind::PermissionDenied => "permission denied".into(),
        io::ErrorKind::StorageFull => "the disk is full".into(),
        io::ErrorKind::QuotaExceeded => "the quota is used up".into(),
        io::ErrorKind::FileTooLarge => "it would be larger than files may be here".into(),
        io::ErrorKind::ReadOnlyFilesystem => "the disk is read-only".into(),
        io::ErrorKind::BrokenPipe => "its reader is gone".into(),
        _ => error.to_string(),
    }
}
