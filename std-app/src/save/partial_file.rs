//! A file under construction: written under a temporary name in the folder of its target, and renamed when it
//! is complete on the disk. Incomplete files are removed, even if the program is terminated by a signal.

use super::destination::folder;
use std::ffi::OsString;
use std::fs::{self, File};
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
    /// Creates an empty file in the folder of `target`, and removes the file of a killed process with the
    /// same number.
    pub(super) fn create(target: &Path) -> io::Result<(Self, File)> {
        let mut name = OsString::from(".");
        name.push(target.file_name().unwrap_or_default());
        name.push(format!(".{}.part", std::process::id()));
        let path = folder(target).join(name);
        let _ = fs::remove_file(&path);
        let file = File::create_new(&path)?;
        partial_files().push(path.clone());
        Ok((Self(path), file))
    }

    /// Renames the file to `target`.
    pub(super) fn rename(self, target: &Path) -> io::Result<()> {
        fs::rename(&self.0, target)?;
        // The folder stores the new name. Some systems cannot open folders, and need not.
        let _ = File::open(folder(target)).and_then(|folder| folder.sync_all());
        Ok(())
    }
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
        assert_eq!(files(), 1);
        // The file of a killed program.
        core::mem::forget(PartialFile::create(&target).unwrap());
        assert_eq!(files(), 2);
        drop(PartialFile::create(&target).unwrap());
        assert_eq!((files(), fs::read(&target).unwrap()), (1, b"whole".to_vec()));
        fs::remove_dir_all(folder).unwrap();
    }
}
