//! OpenEXR and TIFF in a library without feature `formats`: refused.

use super::{FileError, Info, Picture};

fn refused<T>() -> Result<T, FileError> {
    Err(FileError::new("this program is built without feature `formats`, which reads OpenEXR, TIFF and WebP"))
}

pub(super) mod exr {
    pub(in crate::picture) fn info(_: &[u8]) -> Result<super::Info, super::FileError> {
        super::refused()
    }

    pub(in crate::picture) fn decode(_: &[u8]) -> Result<super::Picture, super::FileError> {
        super::refused()
    }
}

pub(super) mod tiff {
    pub(in crate::picture) use super::exr::info;

    pub(in crate::picture) fn decode(_: &[u8], _: &super::Info) -> Result<super::Picture, super::FileError> {
        super::refused()
    }
}
