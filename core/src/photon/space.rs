//! Units of the map: coordinates scaled by a power of two, which is exact, so that the largest is about 2^40.
//! Squared distances neither overflow nor underflow in any units of the scene, from its extent down to 1e-30
//! of it.

/// Binary exponent of the largest coordinate of a map.
const MAX_EXPONENT: i32 = 40;

/// Clamp of query coordinates: four million times the extent of the map. Farther away all photons are equally
/// far in f32.
const MAX_COORDINATE: f32 = (1u64 << 62) as f32;

/// Scale from the units of the scene to those of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Space {
    scale: f32,
}

impl Space {
    /// Units for photons whose largest coordinate in magnitude is `largest`.
    pub(super) fn of(largest: f32) -> Self {
        let exponent = (largest.to_bits() >> 23) as i32 - 127;
        let scale = (MAX_EXPONENT - exponent).clamp(-126, 127);
        Self { scale: if largest > 0.0 { f32::from_bits(((scale + 127) as u32) << 23) } else { 1.0 } }
    }

    /// A place in units of the map.
    #[inline(always)]
    pub(super) fn to_map(self, place: [f32; 3]) -> [f32; 3] {
        place.map(|coordinate| (coordinate * self.scale).clamp(-MAX_COORDINATE, MAX_COORDINATE))
    }

    /// Squared radius in units of the map, finite; `None` if it is negative or NaN.
    #[inline(always)]
    pub(super) fn squared_to_map(self, radius: f32) -> Option<f32> {
        let radius = radius * self.scale;
        (radius >= 0.0).then(|| (radius * radius).min(f32::MAX))
    }

    /// A place in units of the scene.
    pub(super) fn to_scene(self, place: [f32; 3]) -> [f32; 3] {
        place.map(|coordinate| coordinate / self.scale)
    }

    /// Squared distance in units of the scene; infinite or zero where f32 cannot represent it.
    #[inline(always)]
    pub(super) fn squared_to_scene(self, distance: f32) -> f32 {
        distance / self.scale / self.scale
    }
}
