//! A file under construction: written under a temporary name in the folder of its target, and renamed when it
//! is complete on the disk. Incomplete files are removed, even if the program is terminated by a signal.

use super::destination::folder;
use core::hash::BuildHasher;
use std::fs::{self, File};
use std::hash::RandomState;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// All files under construction.
static PARTIAL_FILES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn partial_files() -> MutexGuard<'static, Vec<PathBuf>> {
    PARTIAL_FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The temporary name of a file under construction.
pub(super) struct PartialFile(PathBuf);

impl PartialFile {
    /// Creates an empty file in the folder of `target`. Its name is random, because containers that share a
    /// folder may share numbers of processes, and short, because names have a limit.
    pub(super) fn create(target: &Path) -> io::Result<(Self, File)> {
        let number = RandomState::new().hash_one(std::process::id());
        let path = folder(target).join(format!(".halflight-{number:016x}.part"));
        let file = File::create_new(&path)?;
        partial_files().push(path.clone());
        Ok((Self(path), file))
    }

    /// Renames the file to `target`.
    pub(super) fn rename(&self, target: &Path) -> io::Result<()> {
        fs::rename(&self.0, target)?;
        // The folder stores the new name. Some systems cannot open folders, and need not.
        let _ = File::open(folder(target)).and_then(|folder| folder.sync_all());
        Ok(())
    }

    /// Copies the file to `target`.
    pub(super) fn copy_to(&self, mut target: File) -> io::Result<()> {
        io::copy(&mut File::open(&self.0)?, &mut target)?;
        sync(&target)
    }

    /// Removes the file.
    pub(super) fn remove(self) -> io::Result<()> {
        fs::remove_file(&self.0)
    }
}

/// Flushes a file to the disk, if there is one: some systems of files have none.
pub(super) fn sync(file: &File) -> io::Result<()> {
    match file.sync_all() {
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
        synced => synced,
    }
}

/// Opens an existing file to be overwritten. Without `create`: in a sticky folder Linux refuses it for files
/// of others.
pub(super) fn open_in_place(target: &Path) -> io::Result<File> {
    File::options().write(true).truncate(true).open(target)
}

impl Drop for PartialFile {
    fn drop(&mut self) {
        partial_files().retain(|path| *path != self.0);
        // The file was renamed or is incomplete.
        let _ = fs::remove_file(&self.0);
    }
}

/// Removes all incomplete files, before the program exits early.
pub fn abandon() {
    partial_files().drain(..).for_each(|path| drop(fs::remove_file(path)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn incomplete_files_are_removed() {
        let folder = std::env::temp_dir().join(format!("halflight-part-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let files = || fs::read_dir(&folder).unwrap().count();
        let target = folder.join("a");
        let (part, mut file) = PartialFile::create(&target).unwrap();
        file.write_all(b"whole").unwrap();
        part.rename(&target).unwrap();
        assert_eq!((files(), fs::read(&target).unwrap()), (1, b"whole".to_vec()));

        drop(PartialFile::create(&target).unwrap());
        PartialFile::create(&target).unwrap().0.remove().unwrap();
        assert_eq!((files(), fs::read(&target).unwrap()), (1, b"whole".to_vec()));
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn files_of_one_target_are_independent() {
        let folder = std::env::temp_dir().join(format!("halflight-parts-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let target = folder.join("n".repeat(255));
        let [first, second] = [b"first", b"other"].map(|content| {
            let (part, mut file) = PartialFile::create(&target).unwrap();
            file.write_all(content).unwrap();
            part
        });
        first.rename(&target).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"first");
        second.copy_to(open_in_place(&target).unwrap()).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"other");
        drop((first, second));
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }
}
