//! Rough vertices of a subpath, as far as they decide what supplies its light in a picture with records.
//!
//! A record supplies the light that leaves its surface where the segment behind it ends at a surface that is
//! not specular: a record of irradiance at a surface with a base, a record of a lobe at any rough surface.
//! Light samples find the direct light of the first rough vertex. The [`Rest`] is left to camera paths alone,
//! as without records: caustics above all.

use crate::bsdf::Bsdf;
use bytemuck::{Pod, Zeroable};

/// A vertex that is not specular was met.
const HAS_ROUGH: u32 = 1;
/// More than one was met.
const HAS_TWO: u32 = 1 << 1;
/// The last vertex is not specular.
const LAST_IS_ROUGH: u32 = 1 << 2;
/// The last vertex has a base.
const LAST_HAS_BASE: u32 = 1 << 3;
/// Records of irradiance, and records of lobes, supply the light of the path.
const BY_IRRADIANCE: u32 = 1 << 4;
const BY_LOBES: u32 = 1 << 5;

/// Records that do not supply the light of a path which light samples do not find either, a set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rest(u32);

impl Rest {
    /// Number of sets.
    pub const SETS: u32 = 4;

    /// Light that records or light samples supply.
    pub(in crate::transport) const NONE: Self = Self(0);
    const BESIDE_IRRADIANCE: u32 = 1;
    const BESIDE_LOBES: u32 = 2;

    /// Set number `bits`, modulo [`Rest::SETS`].
    pub(in crate::transport) fn from_bits(bits: u32) -> Self {
        Self(bits % Self::SETS)
    }

    /// Number of the set, below [`Rest::SETS`].
    pub(in crate::transport) fn bits(self) -> u32 {
        self.0
    }

    /// Light that neither records of irradiance nor light samples at the first rough vertex supply.
    pub fn is_beside_irradiance(self) -> bool {
        self.0 & Self::BESIDE_IRRADIANCE != 0
    }

    /// Light that records of lobes do not supply either.
    pub fn is_beside_lobes(self) -> bool {
        self.0 & Self::BESIDE_LOBES != 0
    }

    fn without(supplied: u32) -> Self {
        let irradiance = if supplied & BY_IRRADIANCE == 0 { Self::BESIDE_IRRADIANCE } else { 0 };
        let lobes = if supplied & BY_LOBES == 0 { Self::BESIDE_LOBES } else { 0 };
        Self(irradiance | lobes)
    }
}

/// Set of properties of the vertices so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(in crate::transport) struct History(u32);

impl History {
    fn has(self, property: u32) -> bool {
        self.0 & property != 0
    }

    /// With a vertex at `bsdf`, and the light `supplied` by the segment to it.
    fn with(self, bsdf: &Bsdf, supplied: u32) -> Self {
        let kept = self.0 & (HAS_ROUGH | HAS_TWO | BY_IRRADIANCE | BY_LOBES);
        if bsdf.is_delta() {
            return Self(kept);
        }
        let two = if self.has(HAS_ROUGH) { HAS_TWO } else { 0 };
        let base = if has_base(bsdf) { LAST_HAS_BASE } else { 0 };
        Self(kept | supplied | two | base | HAS_ROUGH | LAST_IS_ROUGH)
    }

    /// Records at the last vertex, of light from a rough one.
    fn of_last(self) -> u32 {
        let irradiance = if self.has(LAST_HAS_BASE) { BY_IRRADIANCE } else { 0 };
        let lobes = if self.has(LAST_IS_ROUGH) { BY_LOBES } else { 0 };
        irradiance | lobes
    }

    /// Camera subpath with a vertex at `bsdf`.
    pub(in crate::transport) fn on_camera_path(self, bsdf: &Bsdf) -> Self {
        self.with(bsdf, self.of_last())
    }

    /// Camera subpath that left its last vertex by a specular coat.
    pub(in crate::transport) fn by_coat(self) -> Self {
        Self(self.0 & !(LAST_HAS_BASE | LAST_IS_ROUGH))
    }

    /// Light subpath with a vertex at `bsdf`.
    pub(in crate::transport) fn on_light_path(self, bsdf: &Bsdf) -> Self {
        let next = self.with(bsdf, 0);
        if self.has(LAST_IS_ROUGH) { Self(next.0 | next.of_last()) } else { next }
    }

    /// Rest of the light of all paths with these vertices and more.
    pub(in crate::transport) fn rest(self) -> Rest {
        Rest::without(self.0)
    }

    /// Rest of the light of an emitter that the last ray of a camera subpath hits.
    pub(in crate::transport) fn rest_of_hit(self) -> Rest {
        let is_direct = !self.has(HAS_TWO) && (!self.has(HAS_ROUGH) || self.has(LAST_IS_ROUGH));
        if is_direct { Rest::NONE } else { self.rest() }
    }

    /// Rest of the light of a light sample at the last vertex of a camera subpath.
    pub(in crate::transport) fn rest_of_sample(self) -> Rest {
        if self.has(HAS_TWO) { self.rest() } else { Rest::NONE }
    }

    /// Rest of the light of a connection of the last vertex with the end of a light subpath that has its own
    /// rest.
    pub(in crate::transport) fn rest_of_connection(self, of_light: Rest) -> Rest {
        Rest(Rest::without(self.0 | self.of_last()).0 & of_light.0)
    }
}

/// True if records of irradiance supply light of `bsdf`.
fn has_base(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Diffuse(_)) || bsdf.has_coated_base()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::bsdf::{Diffuse, Mirror};

    fn diffuse() -> Bsdf {
        Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.5) })
    }

    fn mirror() -> Bsdf {
        Bsdf::Mirror(Mirror { reflectance: Rgb::ONE })
    }

    fn camera(path: &[Bsdf]) -> History {
        path.iter().fold(History::default(), |history, bsdf| history.on_camera_path(bsdf))
    }

    fn light(path: &[Bsdf]) -> History {
        path.iter().fold(History::default(), |history, bsdf| history.on_light_path(bsdf))
    }

    #[test]
    fn records_supply_light_from_a_rough_surface_to_a_base() {
        let is_supplied = |history: History| !history.rest().is_beside_irradiance();
        assert!(is_supplied(camera(&[diffuse(), diffuse()])));
        assert!(is_supplied(camera(&[mirror(), diffuse(), diffuse(), mirror()])));
        assert!(!is_supplied(camera(&[diffuse(), mirror(), diffuse()])));
        assert!(is_supplied(light(&[diffuse(), diffuse()])));
        assert!(!is_supplied(light(&[mirror(), diffuse()])));
        assert!(!is_supplied(light(&[diffuse()])));
    }

    #[test]
    fn caustics_are_left_to_paths_and_direct_light_to_light_samples() {
        let caustic = camera(&[diffuse(), mirror()]).rest_of_hit();
        assert!(caustic.is_beside_irradiance() && caustic.is_beside_lobes());
        assert_ne!(camera(&[diffuse(), mirror(), diffuse()]).rest_of_sample(), Rest::NONE);
        for direct in [&[diffuse()][..], &[mirror(), diffuse()]] {
            assert_eq!(camera(direct).rest_of_sample(), Rest::NONE);
            assert_eq!(camera(direct).rest_of_hit(), Rest::NONE);
        }
        assert_eq!(camera(&[mirror()]).rest_of_hit(), Rest::NONE);
        assert_eq!(camera(&[diffuse(), diffuse()]).rest_of_sample(), Rest::NONE);
        assert_eq!(camera(&[diffuse()]).rest_of_connection(light(&[mirror()]).rest()), Rest::NONE);
    }
}
