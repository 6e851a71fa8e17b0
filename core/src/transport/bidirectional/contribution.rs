//! Contributions of single techniques to a pixel, as a pilot records them.

use bytemuck::{Pod, Zeroable};

pub use crate::transport::walk::history::Rest;

/// Techniques whose counts are chosen together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Camera paths: emission that they hit, and light samples.
    Paths,
    /// Splats of light vertices.
    Splats,
    /// Connections to light vertices.
    Connections,
    /// Merges with photons.
    Merges,
}

/// Number of classes.
pub const CLASSES: usize = 4;

impl Class {
    const ALL: [Self; CLASSES] = [Self::Paths, Self::Splats, Self::Connections, Self::Merges];
}

/// Light of one sample of a technique in a pixel, its weight included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Contribution {
    /// Pixel of the tile, class and rest.
    key: u32,
    /// Mean radiance of the channels.
    pub value: f32,
}

impl Contribution {
    /// Contribution of a technique of `class` to pixel number `place` of the tile, below 2²⁴.
    pub fn new(class: Class, place: u32, value: f32) -> Self {
        Self { key: place | (class as u32) << 24, value }
    }

    /// The same contribution, of light of a `rest`.
    pub fn with_rest(self, rest: Rest) -> Self {
        Self { key: self.key & 0x00ff_ffff | (self.class() as u32 | rest.bits() << 4) << 24, ..self }
    }

    /// Records that do not supply the light.
    pub fn rest(&self) -> Rest {
        Rest::from_bits(self.key >> 28)
    }

    /// Pixel of the tile.
    pub fn place(&self) -> usize {
        (self.key & 0x00ff_ffff) as usize
    }

    /// Class of the technique.
    pub fn class(&self) -> Class {
        Class::ALL[(self.key >> 24) as usize % CLASSES]
    }

    /// True if both are of one sample of one technique, if they have the same position in their lists.
    pub fn is_same(&self, other: &Self) -> bool {
        self.key == other.key
    }
}
