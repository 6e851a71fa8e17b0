//! A file that is being written: beside its place under a name of its own, and renamed into it when all of it is on
//! the disk. A part that is not finished is removed, even if the program is to end at once.

use super::place::folder;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Those that are being written.
static PARTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn parts() -> MutexGuard<'static, Vec<PathBuf>> {
    PARTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The name of such a file.
pub(super) struct Part(PathBuf);

impl Part {
    /// An empty file beside `target`. One that a program of the same number has left when it was killed is removed.
    pub(super) fn create(target: &Path) -> io::Result<(Self, File)> {
        let mut name = OsString::from(".");
        name.push(target.file_name().unwrap_or_default());
        name.push(format!(".{}.part", std::process::id()));
        let path = folder(target).join(name);
        let _ = fs::remove_file(&path);
        let file = File::create_new(&path)?;
        parts().push(path.clone());
        Ok((Self(path), file))
    }

    /// Moves it to `target`.
    pub(super) fn rename(self, target: &Path) -> io::Result<()> {
        fs::rename(&self.0, target)?;
        // The new name is on the disk when the folder is. Some systems cannot open folders, and need not.
        let _ = File::open(folder(target)).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        parts().retain(|part| *part != self.0);
        // It has another name, or is of no use to anybody.
        let _ = fs::remove_file(&self.0);
    }
}

/// Removes all that is half written: for a program that ends at once.
pub fn abandon() {
    parts().drain(..).for_each(|part| drop(fs::remove_file(part)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn what_does_not_get_to_its_place_is_removed() {
        let folder = std::env::temp_dir().join(format!("halflight-part-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let files = || fs::read_dir(&folder).unwrap().count();
        let target = folder.join("a");
        let (part, mut file) = Part::create(&target).unwrap();
        file.write_all(b"whole").unwrap();
        part.rename(&target).unwrap();
        assert_eq!((files(), fs::read(&target).unwrap()), (1, b"whole".to_vec()));

        drop(Part::create(&target).unwrap());
        assert_eq!(files(), 1);
        // Left by a program that was killed.
        core::mem::forget(Part::create(&target).unwrap());
        assert_eq!(files(), 2);
        drop(Part::create(&target).unwrap());
        assert_eq!((files(), fs::read(&target).unwrap()), (1, b"whole".to_vec()));
        fs::remove_dir_all(folder).unwrap();
    }
}
