//! The viewer of `--tev` in a program without feature `tev`: none.

use halflight::save::Image;
use std::io;

/// A viewer, of which there is none.
pub(super) enum Viewer {}

impl Viewer {
    pub(super) fn connect(_: &str) -> io::Result<Self> {
        Err(io::Error::other("this program is built without feature `tev`"))
    }

    pub(super) fn show(&mut self, _: &Image) -> io::Result<()> {
        match *self {}
    }
}
