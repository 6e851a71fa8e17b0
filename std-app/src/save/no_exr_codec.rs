//! OpenEXR files in a library without feature `formats`: refused.

use super::FileError;
use super::exr::ExrFile;

/// The error of a file.
pub(super) fn encode(_: ExrFile) -> Result<Vec<u8>, FileError> {
    Err(FileError::new("this program is built without feature `formats`, which writes .exr"))
}
