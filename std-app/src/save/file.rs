//! Reading of picture files, and atomic writing of all files: a file is written under a temporary name in its
//! folder and then renamed, so that either the old or the new file exists, complete, whenever the program
//! ends. An existing file that cannot be replaced is written in place: a mount point, a file of another user
//! in a sticky folder, or a file in a read-only folder.

use super::destination::{Destination, folder};
use super::exr::ExrFile;
use super::partial_file::{PartialFile, open_in_place, sync};
use super::stream::{self, Patience};
use super::{FileError, Format, Image, encode};
use crate::memory::{self, Budget};
use crate::picture::{self, Kind};
use std::fs::File;
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

/// As [`write_with`], for an OpenEXR file with layers or attributes.
///
/// # Errors
/// A file that cannot be written; the message names it.
pub fn write_exr(path: &Path, file: ExrFile, patience: Patience) -> Result<(), FileError> {
    let bytes = file.encode().map_err(|error| error.at(path))?;
    replace(path, &bytes, patience)
}

/// Writes the output of `put`, which is no picture, to a file, pipe or device.
///
/// # Errors
/// A file that cannot be written; the message names it.
pub fn write_bytes(
    path: &Path,
    put: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    patience: Patience,
) -> Result<(), FileError> {
    replace_with(path, patience, put)
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
        let target = destination.path();
        match PartialFile::create(target) {
            Ok((part, file)) => {
                fill(file, put)?;
                let Err(error) = part.rename(target) else { return Ok(()) };
                part.copy_to(open_in_place(target).map_err(|_| error)?)
            }
            Err(error) => fill(open_in_place(target).map_err(|_| error)?, put),
        }
    };
    written().map_err(|error| not_written(&error, path))
}

/// The error of a file that was not written.
fn not_written(error: &io::Error, path: &Path) -> FileError {
    let reason = match error.kind() {
        io::ErrorKind::NotFound if !folder(path).is_dir() => "its folder does not exist any more".into(),
        _ => FileError::io(error).to_string(),
    };
    FileError::new(format!("cannot be written: {reason}")).at(path)
}

fn fill(file: File, put: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut file = BufWriter::with_capacity(BUFFER, file);
    put(&mut file)?;
    sync(&file.into_inner().map_err(io::IntoInnerError::into_error)?)
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
    let destination = Destination::of(path).map_err(|error| not_written(&error, path))?;
    if destination.is_folder() {
        return refuse(": it is a folder".into());
    }
    if destination.is_stream() {
        return stream::check(&destination).map_err(|error| not_written(&error, path));
    }
    let (target, folder) = (destination.path(), folder(destination.path()));
    if target.file_name().is_none() || !folder.is_dir() {
        return refuse(format!(": there is no folder {}", folder.display()));
    }
    // An existing file that can be overwritten need not be replaceable.
    let tried = match target.exists() {
        true => File::options().write(true).open(target).map(drop),
        false => PartialFile::create(target).and_then(|(part, _)| part.remove()),
    };
    match tried {
        Err(error) if target.exists() => Err(not_written(&error, path)),
        Err(error) => refuse(format!(" in {}: {}", folder.display(), FileError::io(&error))),
        Ok(()) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(path: &Path) -> String {
        check_destination(path).unwrap_err().to_string()
    }

    /// Nobody can create files in the folder of this process, whose name is one that it can change.
    #[cfg(target_os = "linux")]
    #[test]
    fn files_that_cannot_be_replaced_are_written_in_place() {
        let name = Path::new("/proc/self/comm");
        check_destination(name).unwrap();
        replace(name, b"in-place", Patience::least()).unwrap();
        assert_eq!(std::fs::read(name).unwrap(), b"in-place\n");
        assert!(refusal(Path::new("/proc/self/new")).contains("new: cannot be written in /proc/self: "));
    }

    #[cfg(unix)]
    #[test]
    fn sockets_are_refused_and_devices_are_not() {
        let socket = std::env::temp_dir().join(format!("halflight-socket-{}", std::process::id()));
        let listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        assert!(refusal(&socket).ends_with("it is a socket"));
        check_destination(Path::new("/dev/null")).unwrap();
        drop(listener);
        std::fs::remove_file(socket).unwrap();
    }

    #[test]
    fn folders_are_no_files() {
        let folder = std::env::temp_dir().join(format!("halflight-folders-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("a.png")).unwrap();
        assert!(refusal(&folder.join("a.png")).ends_with("it is a folder"));
        assert!(refusal(&folder.join("none/a.png")).contains("there is no folder"));
        let new = folder.join("b.png/");
        check_destination(&new).unwrap();
        replace(&new, b"b", Patience::least()).unwrap();
        assert_eq!(std::fs::read(folder.join("b.png")).unwrap(), b"b");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
