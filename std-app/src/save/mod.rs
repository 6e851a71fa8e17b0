//! Pictures in files: PNG for display, EXR, HDR and PFM for values. [`crate::picture`] reads all formats.

mod agx;
mod destination;
mod exr;
#[cfg_attr(not(feature = "formats"), path = "no_exr_codec.rs")]
mod exr_codec;
mod file;
mod format;
mod image;
mod partial_file;
mod stream;
mod view;

pub use crate::file_error::FileError;
pub use crate::picture::MAX_PIXELS;
pub use destination::{Destination, Identity};
pub use exr::{Attribute, ExrFile};
#[cfg(feature = "report")]
pub(crate) use file::replace;
pub(crate) use file::replace_with;
pub use file::{
    check_destination, check_writable, read, read_within, write, write_bytes, write_exr, write_with,
};
pub use format::{Format, encode};
pub use image::{Image, display_byte, from_srgb, to_srgb};
pub use partial_file::abandon;
pub use stream::Patience;
pub use view::{Curve, ViewTransform, automatic_stops};
