//! Detection of the format by the first bytes of a file, for TGA by its name.

use super::{FileError, fail};
use std::path::Path;

/// The format of a picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Portable network graphics, 8 or 16 bits.
    Png,
    /// JPEG, baseline or progressive.
    Jpeg,
    /// Windows bitmap.
    Bmp,
    /// Truevision TGA; older files have no signature.
    Tga,
    /// WebP; the first frame of an animation.
    WebP,
    /// TIFF, integers or floats; the first of several pictures.
    Tiff,
    /// Radiance.
    Hdr,
    /// OpenEXR.
    Exr,
    /// Portable float map.
    Pfm,
}

/// All formats, for a message.
const NAMES: &str = "png, jpg, bmp, tga, webp, tiff, hdr, exr, pfm";

impl Kind {
    /// The format of a file.
    ///
    /// # Errors
    /// The format is unknown.
    pub fn of(bytes: &[u8], name: &Path) -> Result<Self, FileError> {
        let extension = name.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        let by_name = matches!(extension.as_deref(), Some("tga" | "targa" | "icb" | "vda" | "vst"));
        Ok(match bytes {
            [0x89, b'P', b'N', b'G', ..] => Self::Png,
            [0xff, 0xd8, 0xff, ..] => Self::Jpeg,
            [0x76, 0x2f, 0x31, 0x01, ..] => Self::Exr,
            [b'#', b'?', ..] => Self::Hdr,
            [b'P', b'F' | b'f', next, ..] if next.is_ascii_whitespace() || *next == b'4' => Self::Pfm,
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Self::WebP,
            [b'I', b'I', b'*' | b'+', 0, ..] | [b'M', b'M', 0, b'*' | b'+', ..] => Self::Tiff,
            [b'B', b'M', ..] => Self::Bmp,
            [0xab, b'K', b'T', b'X', ..] => fail!(
                "KTX is not read: `ktx extract` makes a PNG of it, and `npx @gltf-transform/cli ktxdecompress` \
                 those of a glTF file"
            ),
            _ if by_name || bytes.ends_with(b"TRUEVISION-XFILE.\0") => Self::Tga,
            _ => fail!("it is in no format that is known ({NAMES})"),
        })
    }
}
