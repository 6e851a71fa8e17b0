//! Merging of the shards of a bake into its tables, map or probes.

use super::attachment::{BakeSubject, subject_of};
use super::table::Quantity;
use crate::file_error::FileError;
use crate::render::{Baked, RenderError, merge_points};
use std::path::{Path, PathBuf};

pub use crate::render::is_bake;

/// Values of all shards with the subject and the quantity of their outputs.
pub struct MergedBake {
    /// Values and statistics.
    pub baked: Baked,
    /// Meaning of the values, in their order.
    pub subject: BakeSubject,
    /// Quantity of the outputs.
    pub quantity: Quantity,
}

/// Merges the bakes in `files`, in any order.
///
/// # Errors
/// Names the first file that does not belong to the first one and why, or missing and repeated shards.
pub fn merge(files: &[PathBuf]) -> Result<MergedBake, RenderError> {
    let (baked, points, attached) = merge_points(files)?;
    let name = files.first().map_or(Path::new("bake"), PathBuf::as_path);
    let damage = || FileError::new("is damaged: its points have no outputs").at(name);
    let (subject, quantity) = subject_of(&attached, points).ok_or_else(damage)?;
    Ok(MergedBake { baked, subject, quantity })
}
