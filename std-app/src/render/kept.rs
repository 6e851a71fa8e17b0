//! A file that is written while a picture grows, and again at the end: the film of a checkpoint, irradiance caches.
//! A write that fails on the way costs nothing but the file: the last whole one stays, the next write tries again.

use super::FileError;
use crate::save::{Destination, Patience};
use core::cell::Cell;
use std::path::Path;

/// Such a file; without a name there is none.
#[derive(Default)]
pub(super) struct Kept<'a> {
    path: Option<&'a Path>,
    /// Pipes and devices cannot be replaced: they have the last of all alone.
    is_stream: bool,
    /// Whether there is something newer than the file.
    is_owed: bool,
    failed: Option<FileError>,
    is_known: Cell<bool>,
}

impl<'a> Kept<'a> {
    /// In the file of this name.
    pub(super) fn in_file(path: Option<&'a Path>) -> Self {
        let is_stream =
            path.is_some_and(|path| Destination::of(path).is_ok_and(|destination| destination.is_stream()));
        Self { path, is_stream, ..Self::default() }
    }

    /// On the way.
    pub(super) fn update(&mut self, write: impl FnOnce(&Path, Patience) -> Result<(), FileError>) {
        if self.is_stream {
            self.is_owed = true;
        } else {
            self.finish(Patience::least(), write);
        }
    }

    /// On the way, or in the `last` place, where the write before failed or was put off.
    pub(super) fn keep(
        &mut self,
        last: Option<Patience>,
        write: impl FnOnce(&Path, Patience) -> Result<(), FileError>,
    ) {
        match last {
            None => self.update(write),
            Some(patience) if self.is_owed => self.finish(patience, write),
            Some(_) => {}
        }
    }

    /// At the end, whatever was written before.
    pub(super) fn finish(
        &mut self,
        patience: Patience,
        write: impl FnOnce(&Path, Patience) -> Result<(), FileError>,
    ) {
        self.failed = self.path.and_then(|path| write(path, patience).err());
        self.is_owed = self.failed.is_some();
    }

    /// Why the last write failed, asked for the first time.
    pub(super) fn news(&self) -> Option<FileError> {
        let failed = self.failed.clone();
        failed.filter(|_| !self.is_known.replace(true))
    }

    /// Why it is not there as it should be.
    pub(super) fn failed(&self) -> Option<FileError> {
        self.failed.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fails_is_news_once_and_forgotten_when_it_is_there() {
        let mut kept = Kept::in_file(Some(Path::new("film")));
        let fail = |path: &Path, _: Patience| Err(FileError::new(path, "cannot be written"));
        kept.update(fail);
        assert_eq!(kept.news().map(|error| error.to_string()).as_deref(), Some("film: cannot be written"));
        kept.update(fail);
        assert_eq!((kept.news(), kept.failed().is_some()), (None, true));
        kept.keep(Some(Patience::least()), |_, _| Ok(()));
        assert_eq!((kept.news(), kept.failed()), (None, None));
        kept.keep(Some(Patience::least()), |_, _| panic!("it is there already"));
    }

    #[test]
    fn without_a_name_nothing_is_written() {
        Kept::default().finish(Patience::least(), |_, _| panic!("there is no file"));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_has_the_last_of_all_alone() {
        let mut count = 0;
        let mut kept = Kept::in_file(Some(Path::new("/dev/null")));
        kept.update(|_, _| panic!("not on the way"));
        kept.finish(Patience::least(), |_, _| {
            count += 1;
            Ok(())
        });
        assert_eq!(count, 1);
    }
}
