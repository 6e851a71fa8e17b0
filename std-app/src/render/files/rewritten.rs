//! A file rewritten during a render and at its end: film checkpoints and irradiance caches. A failed write
//! leaves the last complete file, and the next write retries.

use crate::file_error::FileError;
use crate::save::{Destination, Patience};
use core::cell::Cell;
use std::path::Path;

/// A rewritten file; inactive without a path.
#[derive(Default)]
pub(in crate::render) struct RewrittenFile<'a> {
    path: Option<&'a Path>,
    /// True if it is a pipe or device, which cannot be replaced and receives only the last write.
    is_stream: bool,
    /// True if the file is older than the state of the render.
    is_owed: bool,
    failed: Option<FileError>,
    is_known: Cell<bool>,
}

impl<'a> RewrittenFile<'a> {
    /// A file at `path`.
    pub(in crate::render) fn in_file(path: Option<&'a Path>) -> Self {
        let is_stream =
            path.is_some_and(|path| Destination::of(path).is_ok_and(|destination| destination.is_stream()));
        Self { path, is_stream, ..Self::default() }
    }

    /// Writes during the render.
    pub(in crate::render) fn update(&mut self, write: impl FnOnce(&Path, Patience) -> Result<(), FileError>) {
        if self.is_stream {
            self.is_owed = true;
        } else {
            self.finish(Patience::least(), write);
        }
    }

    /// Writes during the render; with the `last` patience only after a failed or postponed write.
    pub(in crate::render) fn keep(
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

    /// Writes at the end unconditionally.
    pub(in crate::render) fn finish(
        &mut self,
        patience: Patience,
        write: impl FnOnce(&Path, Patience) -> Result<(), FileError>,
    ) {
        self.failed = self.path.and_then(|path| write(path, patience).err());
        self.is_owed = self.failed.is_some();
    }

    /// Why the last write failed; on the first call only.
    pub(in crate::render) fn new_failure(&self) -> Option<FileError> {
        let failed = self.failed.clone();
        failed.filter(|_| !self.is_known.replace(true))
    }

    /// Why the file is missing or out of date.
    pub(in crate::render) fn failed(&self) -> Option<FileError> {
        self.failed.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_is_reported_once_and_cleared_by_the_next_write() {
        let mut file = RewrittenFile::in_file(Some(Path::new("film")));
        let fail = |path: &Path, _: Patience| Err(FileError::new("cannot be written").at(path));
        file.update(fail);
        assert_eq!(
            file.new_failure().map(|error| error.to_string()).as_deref(),
            Some("film: cannot be written")
        );
        file.update(fail);
        assert_eq!((file.new_failure(), file.failed().is_some()), (None, true));
        file.keep(Some(Patience::least()), |_, _| Ok(()));
        assert_eq!((file.new_failure(), file.failed()), (None, None));
        file.keep(Some(Patience::least()), |_, _| panic!("it is written already"));
    }

    #[test]
    fn without_a_name_nothing_is_written() {
        RewrittenFile::default().finish(Patience::least(), |_, _| panic!("there is no file"));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_gets_the_last_write_alone() {
        let mut count = 0;
        let mut file = RewrittenFile::in_file(Some(Path::new("/dev/null")));
        file.update(|_, _| panic!("not during the render"));
        file.finish(Patience::least(), |_, _| {
            count += 1;
            Ok(())
        });
        assert_eq!(count, 1);
    }
}
