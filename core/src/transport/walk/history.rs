//! Rough vertices of a subpath, as far as they decide what supplies its light in a picture with records.
//!
//! A record supplies the light that leaves its surface where the segment behind it ends at a surface that is
//! not specular: a record of irradiance at a surface with a base, a record of a lobe at any rough surface.
//! Light samples find the direct light of the first rough vertex. Caustic photons supply light that comes by
//! casters alone to its first receiver, a vertex that is no caster. The [`Rest`] is left to camera paths.

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
/// A receiver was met, and more than one.
const HAS_RECEIVER: u32 = 1 << 6;
const HAS_TWO_RECEIVERS: u32 = 1 << 7;
/// The last vertex is a receiver.
const LAST_RECEIVES: u32 = 1 << 8;
/// Casters alone lie between the last vertex and the last receiver, or the emitter of a light subpath.
const BY_CASTERS: u32 = 1 << 9;
/// Casters alone lie between the emitter of a light subpath and its first receiver.
const IS_CAUSTIC: u32 = 1 << 10;
/// Properties of all vertices.
const KEPT: u32 =
    HAS_ROUGH | HAS_TWO | BY_IRRADIANCE | BY_LOBES | HAS_RECEIVER | HAS_TWO_RECEIVERS | IS_CAUSTIC;

/// Means that do not supply the light of a path which light samples do not find either, a set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rest(u32);

impl Rest {
    /// Number of sets.
    pub const SETS: u32 = 16;

    /// Light that records or light samples supply.
    pub(crate) const NONE: Self = Self(0);
    const BESIDE_IRRADIANCE: u32 = 1;
    const BESIDE_LOBES: u32 = 2;
    /// Photons supply the light; photons beside records, too.
    const BY_PHOTONS: u32 = 4;
    const BY_PHOTONS_BESIDE_RECORDS: u32 = 8;
    /// An emitter that is seen directly, or by specular vertices alone.
    const SEEN: Self = Self(Self::BY_PHOTONS_BESIDE_RECORDS);

    /// Set number `bits`, modulo [`Rest::SETS`].
    pub(crate) fn from_bits(bits: u32) -> Self {
        Self(bits % Self::SETS)
    }

    /// Number of the set, below [`Rest::SETS`].
    pub(crate) fn bits(self) -> u32 {
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

    /// Light of an emitter that is seen directly, or by specular vertices alone: it is noise at edges alone.
    pub fn is_seen(self) -> bool {
        self == Self::SEEN
    }

    /// Light that caustic photons supply; `beside_records`, where records supply light, too.
    pub fn is_of_photons(self, beside_records: bool) -> bool {
        self.0 & if beside_records { Self::BY_PHOTONS_BESIDE_RECORDS } else { Self::BY_PHOTONS } != 0
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
pub(crate) struct History(u32);

impl History {
    fn has(self, property: u32) -> bool {
        self.0 & property != 0
    }

    /// With a vertex at `bsdf`, and the light `supplied` by the segment to it.
    fn with(self, bsdf: &Bsdf, supplied: u32) -> Self {
        let receivers = match bsdf.is_caustic_caster() {
            true => 0,
            false if self.has(HAS_RECEIVER) => HAS_TWO_RECEIVERS | LAST_RECEIVES,
            false => HAS_RECEIVER | LAST_RECEIVES,
        };
        let kept = self.0 & KEPT | receivers;
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
    pub(crate) fn on_camera_path(self, bsdf: &Bsdf) -> Self {
        let is_cast = bsdf.is_caustic_caster() && (self.has(LAST_RECEIVES) || self.has(BY_CASTERS));
        let next = self.with(bsdf, self.of_last());
        Self(next.0 | if is_cast { BY_CASTERS } else { 0 })
    }

    /// Camera subpath that left its last vertex by a specular coat.
    pub(crate) fn by_coat(self) -> Self {
        Self(self.0 & !(LAST_HAS_BASE | LAST_IS_ROUGH | LAST_RECEIVES))
    }

    /// Light subpath with a vertex at `bsdf`.
    pub(crate) fn on_light_path(self, bsdf: &Bsdf) -> Self {
        let next = self.with(bsdf, 0);
        let of_last = if self.has(LAST_IS_ROUGH) { next.of_last() } else { 0 };
        let by_casters = match (self.has(HAS_RECEIVER), bsdf.is_caustic_caster()) {
            (false, true) => BY_CASTERS,
            (false, false) if self.has(BY_CASTERS) => IS_CAUSTIC,
            _ => 0,
        };
        Self(next.0 | of_last | by_casters)
    }

    /// Rest of light that is a caustic or not.
    fn rest_of(self, is_caustic: bool) -> Rest {
        let of_photons = match is_caustic {
            false => 0,
            true if self.has(HAS_TWO_RECEIVERS) => Rest::BY_PHOTONS,
            true => Rest::BY_PHOTONS | Rest::BY_PHOTONS_BESIDE_RECORDS,
        };
        Rest(Rest::without(self.0).0 | of_photons)
    }

    /// Rest of the light of a light subpath.
    pub(crate) fn rest(self) -> Rest {
        self.rest_of(self.has(IS_CAUSTIC))
    }

    /// Rest of the light of merges at the last vertex of a camera subpath. Their photons may be caustic.
    pub(crate) fn rest_of_merge(self) -> Rest {
        Rest(self.rest_of(true).0 | Rest::BY_PHOTONS_BESIDE_RECORDS)
    }

    /// Rest of light that comes to the last vertex of a camera subpath straight from an emitter.
    fn rest_of_emission(self) -> Rest {
        self.rest_of(self.has(HAS_RECEIVER) && self.has(BY_CASTERS))
    }

    /// Rest of the light of an emitter that the last ray of a camera subpath hits.
    pub(crate) fn rest_of_hit(self) -> Rest {
        let is_direct = !self.has(HAS_TWO) && self.has(LAST_IS_ROUGH);
        match self.has(HAS_ROUGH) {
            false => Rest::SEEN,
            true if is_direct => Rest::NONE,
            true => self.rest_of_emission(),
        }
    }

    /// Rest of the light of a light sample at the last vertex of a camera subpath.
    pub(crate) fn rest_of_sample(self) -> Rest {
        if self.has(HAS_TWO) { self.rest_of_emission() } else { Rest::NONE }
    }

    /// Rest of the light of a connection of the last vertex with the end of a light subpath that has its own
    /// rest.
    pub(crate) fn rest_of_connection(self, of_light: Rest) -> Rest {
        let beside_records = Rest::without(self.0 | self.of_last()).0 & of_light.0;
        Rest(beside_records | of_light.0 & Rest::BY_PHOTONS)
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
        assert!(camera(&[mirror()]).rest_of_hit().is_seen());
        assert_eq!(camera(&[diffuse(), diffuse()]).rest_of_sample(), Rest::NONE);
        assert_eq!(camera(&[diffuse()]).rest_of_connection(light(&[mirror()]).rest()), Rest::NONE);
    }

    #[test]
    fn photons_supply_light_that_comes_by_casters_to_its_first_receiver() {
        let of_photons = |rest: Rest| [false, true].map(|beside_records| rest.is_of_photons(beside_records));
        let hit = |path: &[Bsdf]| of_photons(camera(path).rest_of_hit());
        assert_eq!(hit(&[diffuse(), mirror(), mirror()]), [true; 2]);
        // Records do not supply light from another receiver by a mirror.
        assert_eq!(hit(&[diffuse(), mirror(), diffuse(), mirror()]), [true, false]);
        assert_eq!(hit(&[diffuse(), diffuse()]), [false; 2]);
        assert_eq!(of_photons(camera(&[diffuse(), mirror(), diffuse()]).rest_of_sample()), [false; 2]);
        let leaves = |path: &[Bsdf]| of_photons(light(path).rest());
        assert_eq!(leaves(&[mirror(), diffuse()]), [true; 2]);
        assert_eq!(leaves(&[mirror(), diffuse(), mirror(), diffuse()]), [true, false]);
        assert_eq!(leaves(&[diffuse(), mirror(), diffuse()]), [false; 2]);
        let connected = camera(&[diffuse()]).rest_of_connection(light(&[mirror(), diffuse()]).rest());
        assert_eq!(of_photons(connected), [true, false]);
        // The coat of a receiver casts no photons.
        let coated = camera(&[diffuse()]).by_coat().on_camera_path(&mirror());
        assert_eq!(of_photons(coated.rest_of_hit()), [false; 2]);
    }
}
