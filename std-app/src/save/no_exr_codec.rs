//! OpenEXR files in a library without feature `formats`: refused.

use super::FileError;
use super::exr::ExrFile;
use crate::picture::fail;

impl ExrFile<'_> {
    /// The error of a library without feature `formats`.
    ///
    /// # Errors
    /// Always.
    pub fn encode(self) -> Result<Vec<u8>, FileError> {
        let [width, height] = [self.image.width, self.image.height];
        fail!(
            "{width}x{height} pixels cannot be written as .exr: this program is built without feature `formats`"
        )
    }
}
