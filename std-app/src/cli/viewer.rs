//! The viewer of `--tev`.

pub(super) use halflight::tev::Viewer;
