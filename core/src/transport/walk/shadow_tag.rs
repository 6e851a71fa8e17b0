//! Tags of shadow rays: whose light a ray brings, and what kind of light it is.

use crate::transport::walk::history::Rest;

/// Tag of a shadow ray. Bits 0 to 26 are the index of a path, bit 27 is a flag; or bits 0 to 27 are the
/// position of a pixel. Bits 28 to 31 are the [`Rest`] of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ShadowTag(pub u32);

/// Light of the environment, or of a connection.
const FLAG: u32 = 1 << 27;

/// Least bit of the rest.
const REST: u32 = 28;

impl ShadowTag {
    /// A light sample of path `index`. The radiance of the environment is looked up after arrival: most rays
    /// are occluded, and an environment map is large.
    #[inline]
    pub(crate) fn of_light_sample(index: u32, to_environment: bool) -> Self {
        Self(index | if to_environment { FLAG } else { 0 })
    }

    /// A light sample or a connection of path `index`, of light of a `rest`.
    #[inline]
    pub(crate) fn of_technique(index: u32, is_connection: bool, rest: Rest) -> Self {
        Self(Self::of_light_sample(index, is_connection).0 | rest.bits() << REST)
    }

    /// A splat on the pixel at `position` of the film, of light of a `rest`.
    #[inline]
    pub(crate) fn of_splat(position: u32, rest: Rest) -> Self {
        Self(position | rest.bits() << REST)
    }

    /// Index of the path.
    #[inline]
    pub(crate) fn path(self) -> usize {
        (self.0 & (FLAG - 1)) as usize
    }

    /// True for a light sample of the environment, and for a connection.
    #[inline]
    pub(crate) fn is_flagged(self) -> bool {
        self.0 & FLAG != 0
    }

    /// Position of the pixel.
    pub(crate) fn pixel(self) -> u32 {
        self.0 & ((1 << REST) - 1)
    }

    /// Rest of the light.
    pub(crate) fn rest(self) -> Rest {
        Rest::from_bits(self.0 >> REST)
    }
}
