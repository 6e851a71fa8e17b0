//! Bytes of a file, of which pictures and buffers are parts.

use core::ops::{Deref, Range};
use std::sync::Arc;

/// A range of shared bytes.
#[derive(Clone, Debug)]
pub(super) struct Bytes {
    of: Arc<Vec<u8>>,
    range: Range<usize>,
}

impl Bytes {
    /// A part; `None` if it does not lie in these bytes.
    pub(in crate::load) fn part(&self, offset: u64, length: u64) -> Option<Self> {
        let start = usize::try_from(offset).ok()?;
        let end = start.checked_add(usize::try_from(length).ok()?)?;
        let within = end <= self.range.len();
        within.then(|| Self { of: self.of.clone(), range: self.range.start + start..self.range.start + end })
    }
}

impl From<Vec<u8>> for Bytes {
    fn from(bytes: Vec<u8>) -> Self {
        Self { range: 0..bytes.len(), of: Arc::new(bytes) }
    }
}

impl Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.of[self.range.clone()]
    }
}
