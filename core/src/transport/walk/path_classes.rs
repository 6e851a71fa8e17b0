//! Classes of light paths by the surfaces behind a vertex (Heckbert 1990). An estimator supplies the light of
//! some classes; its path finds the others.

use crate::bsdf::Bsdf;
use bytemuck::{Pod, Zeroable};

/// Set of classes that a path still has to find behind its ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct PathClasses(u32);

/// Emission of surfaces.
const EMISSION: u32 = 1;
/// Light of the environment.
const ENVIRONMENT: u32 = 1 << 1;
/// Light that specular surfaces reflect and transmit.
const SPECULAR: u32 = 1 << 2;
/// Light that non-specular surfaces reflect and transmit.
const ROUGH: u32 = 1 << 3;
/// Light of emitters behind specular surfaces.
const CAUSTIC: u32 = 1 << 4;
/// Flag, no class of light: the path may end in a photon map.
const GATHERED: u32 = 1 << 5;
/// Flag, no class of light: specular surfaces keep the set.
const BEHIND_SPECULAR: u32 = 1 << 6;

impl PathClasses {
    /// All light.
    pub(crate) const ALL: Self = Self(EMISSION | ENVIRONMENT | SPECULAR | ROUGH | CAUSTIC);
    /// Light of emitters, direct or by specular surfaces; the irradiance cache supplies the rest.
    pub(crate) const DIRECT: Self = Self(Self::ALL.0 & !ROUGH);
    /// Light that non-specular surfaces reflect: gather rays of a record find it.
    pub(crate) const REFLECTED: Self = Self(ROUGH | GATHERED);
    /// Light that surfaces scatter; light samples or other paths supply that of emitters.
    pub(crate) const SCATTERED: Self = Self(Self::ALL.0 & !(EMISSION | ENVIRONMENT));
    /// Light directly from emitters; photons supply the rest.
    pub(crate) const EMITTED: Self = Self(EMISSION | ENVIRONMENT);
    /// All light except caustics, with photon maps: the path may end at the next surface with a diffuse part.
    pub(crate) const NO_CAUSTIC: Self = Self(Self::ALL.0 & !CAUSTIC | GATHERED);
    /// [`Self::NO_CAUSTIC`] behind a specular surface, where light of emitters is a caustic.
    pub(crate) const BEHIND_MIRROR: Self = Self(SPECULAR | ROUGH | GATHERED);
    /// All light, with photon maps: the path may end at the next surface with a diffuse part.
    pub(crate) const GATHERED: Self = Self(Self::ALL.0 | GATHERED);
    /// All light except the emission of the lamp on a camera ray, for which the pixel has separate rays.
    pub(crate) const WITHOUT_EMISSION: Self = Self(Self::ALL.0 & !EMISSION);
    /// All light except emitters that the camera sees, directly or by specular surfaces.
    pub(crate) const WITHOUT_VISIBLE_EMITTERS: Self = Self(SPECULAR | ROUGH | CAUSTIC | BEHIND_SPECULAR);

    #[inline]
    const fn has(self, class: u32) -> bool {
        self.0 & class != 0
    }

    /// Intersection of both sets.
    #[inline]
    pub(crate) const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// True if the path ends at `bsdf`, because the set holds no light that `bsdf` reflects or transmits.
    #[inline]
    pub(crate) fn ends_at(self, bsdf: &Bsdf) -> bool {
        !self.has(if bsdf.is_delta() { SPECULAR } else { ROUGH })
    }

    /// True if the set holds light that non-specular surfaces reflect.
    #[inline]
    pub(crate) fn has_rough(self) -> bool {
        self.has(ROUGH)
    }

    /// Classes to find behind `bsdf`, at which no estimator supplies light.
    #[inline]
    pub(crate) fn behind(self, bsdf: &Bsdf) -> Self {
        if self.has(BEHIND_SPECULAR) && bsdf.is_delta() { self } else { Self::ALL }
    }

    /// True if the set holds light of the environment.
    #[inline]
    pub(crate) fn has_environment(self) -> bool {
        self.has(ENVIRONMENT)
    }

    /// True if the set holds emission of surfaces.
    #[inline]
    pub(crate) fn has_emission(self) -> bool {
        self.has(EMISSION)
    }

    /// True if photons supply the caustics.
    #[inline]
    pub(crate) fn excludes_caustics(self) -> bool {
        self == Self::NO_CAUSTIC || self == Self::BEHIND_MIRROR
    }

    /// True if the path may end in a photon map.
    #[inline]
    pub(crate) fn may_end_in_photon_map(self) -> bool {
        self.has(GATHERED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_structure_knows_and_what_the_path_finds_are_disjoint_and_complete() {
        let light = |set: PathClasses| set.0 & PathClasses::ALL.0;
        // The cache supplies the light that gather rays find. Its path finds the rest, except where specular
        // surfaces reflect the cached light.
        let cached = ROUGH;
        assert_eq!(light(PathClasses::DIRECT) & cached, 0);
        assert_eq!(light(PathClasses::DIRECT) | cached, PathClasses::ALL.0);
        assert_eq!(light(PathClasses::REFLECTED), cached);
        // Photons supply all light except direct light of emitters.
        assert_eq!(light(PathClasses::EMITTED) | (SPECULAR | ROUGH | CAUSTIC), PathClasses::ALL.0);
        // A caustic map supplies caustics alone.
        assert_eq!(light(PathClasses::NO_CAUSTIC) | CAUSTIC, PathClasses::ALL.0);
        assert_eq!(light(PathClasses::GATHERED), PathClasses::ALL.0);
        assert_eq!(PathClasses::DIRECT.and(PathClasses::ALL), PathClasses::DIRECT);
    }
}
