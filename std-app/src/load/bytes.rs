//! Bytes of a file, of which pictures and buffers are parts.

use core::ops::{Deref, Range};
use std::sync::Arc;

/// A range of shared bytes.
#[derive(Clone, Debug)]
pub(super) struct Bytes {
    pub(super) of: Arc<Vec<u8>>,
    pub(super) range: Range<usize>,
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
