//! `[sky]` in a library without feature `sky`: refused.

use super::light::EnvironmentChange;
use super::{LoadError, Source};
use crate::memory::Budget;
use serde::Deserialize;
use toml::Spanned;

/// A clear sky, with any keys.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct SkyEntry {}

/// The error of a sky.
pub(super) fn environment(
    entry: &Spanned<SkyEntry>,
    _: &mut Budget,
    source: &Source,
) -> Result<EnvironmentChange, LoadError> {
    let problem = "this program is built without feature `sky`, which computes [sky]";
    Err(source.error(entry.span(), problem, "build it with the feature, or give an [environment]"))
}
