//! Classes of light paths, by what they meet behind a vertex (Heckbert 1990). An estimator knows the light of
//! some classes; its path has to find the others.

use crate::bsdf::Bsdf;
use bytemuck::{Pod, Zeroable};

/// The classes that a path is still to find at the end of its ray: a set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(in crate::transport) struct Components(u32);

/// Emission of surfaces.
const EMISSION: u32 = 1;
/// Light of the environment.
const ENVIRONMENT: u32 = 1 << 1;
/// Light that specular surfaces reflect and transmit.
const SPECULAR: u32 = 1 << 2;
/// Light that other surfaces reflect and transmit.
const ROUGH: u32 = 1 << 3;
/// Light of emitters behind specular surfaces.
const CAUSTIC: u32 = 1 << 4;
/// No class of light: the path may end in a photon map.
const GATHERED: u32 = 1 << 5;
/// No class of light: the set is the same behind specular surfaces.
const BEHIND_SPECULAR: u32 = 1 << 6;

impl Components {
    /// All light.
    pub(in crate::transport) const ALL: Self = Self(EMISSION | ENVIRONMENT | SPECULAR | ROUGH | CAUSTIC);
    /// Light of emitters, straight or by specular surfaces: a cache knows the rest.
    pub(in crate::transport) const DIRECT: Self = Self(Self::ALL.0 & !ROUGH);
    /// The rest: gather rays for a cache find it.
    pub(in crate::transport) const REFLECTED: Self = Self(ROUGH | GATHERED);
    /// Light straight from emitters: photons know the rest.
    pub(in crate::transport) const EMITTED: Self = Self(EMISSION | ENVIRONMENT);
    /// All but caustics, with photon maps: from a surface with a diffuse part to the next, where the path may
    /// end.
    pub(in crate::transport) const NO_CAUSTIC: Self = Self(Self::ALL.0 & !CAUSTIC | GATHERED);
    /// The same behind a specular surface, where light of emitters is a caustic.
    pub(in crate::transport) const BEHIND_MIRROR: Self = Self(SPECULAR | ROUGH | GATHERED);
    /// All light, with photon maps: the path may end at the next surface with a diffuse part.
    pub(in crate::transport) const GATHERED: Self = Self(Self::ALL.0 | GATHERED);
    /// All light but the lamp that a camera ray meets, for which its pixel has rays of their own.
    pub(in crate::transport) const BESIDE_LAMP: Self = Self(Self::ALL.0 & !EMISSION);
    /// All light but that of emitters which the camera sees, straight or by specular surfaces.
    pub(in crate::transport) const UNSEEN: Self = Self(SPECULAR | ROUGH | CAUSTIC | BEHIND_SPECULAR);

    const fn has(self, class: u32) -> bool {
        self.0 & class != 0
    }

    /// The classes that both are to find.
    pub(in crate::transport) const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Whether the path ends at `bsdf`, as it is to find no light that this reflects or transmits.
    #[inline]
    pub(in crate::transport) fn ends_at(self, bsdf: &Bsdf) -> bool {
        !self.has(if bsdf.is_delta() { SPECULAR } else { ROUGH })
    }

    /// Whether light that a rough surface reflects is among them.
    #[inline]
    pub(in crate::transport) fn goes_on_from_rough(self) -> bool {
        self.has(ROUGH)
    }

    /// The classes to find behind `bsdf`, where no structure knows any light.
    #[inline]
    pub(in crate::transport) fn behind(self, bsdf: &Bsdf) -> Self {
        if self.has(BEHIND_SPECULAR) && bsdf.is_delta() { self } else { Self::ALL }
    }

    /// Whether light of the environment is among them.
    #[inline]
    pub(in crate::transport) fn has_environment(self) -> bool {
        self.has(ENVIRONMENT)
    }

    /// Whether emission of surfaces is among them.
    #[inline]
    pub(in crate::transport) fn has_emission(self) -> bool {
        self.has(EMISSION)
    }

    /// Whether photons know the caustics.
    #[inline]
    pub(in crate::transport) fn leaves_caustics(self) -> bool {
        self == Self::NO_CAUSTIC || self == Self::BEHIND_MIRROR
    }

    /// Whether the path may end in a photon map.
    #[inline]
    pub(in crate::transport) fn is_gathered(self) -> bool {
        self.has(GATHERED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_structure_knows_and_what_the_path_finds_are_disjoint_and_complete() {
        let light = |set: Components| set.0 & Components::ALL.0;
        // A cache knows what gather rays find, and its path finds the rest but for what specular surfaces
        // show of it.
        let cached = ROUGH;
        assert_eq!(light(Components::DIRECT) & cached, 0);
        assert_eq!(light(Components::DIRECT) | cached, Components::ALL.0);
        assert_eq!(light(Components::REFLECTED), cached);
        // Photons know all but what comes straight from emitters.
        assert_eq!(light(Components::EMITTED) | (SPECULAR | ROUGH | CAUSTIC), Components::ALL.0);
        // A caustic map knows caustics alone.
        assert_eq!(light(Components::NO_CAUSTIC) | CAUSTIC, Components::ALL.0);
        assert_eq!(light(Components::GATHERED), Components::ALL.0);
        assert_eq!(Components::DIRECT.and(Components::ALL), Components::DIRECT);
    }
}
